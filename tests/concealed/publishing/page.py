"""The page of the proof, written from outcomes alone: figures, pictures, failures, and how to make it again."""

import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from ruamel.yaml import YAML

from concealed.baselines.comparison import ranked, table
from concealed.generator.case import SERIES, SIGNS
from concealed.publishing.overview import overview
from concealed.publishing.pictures import draw_all
from concealed.real.table import table as real_table
from concealed.running.kept import Outcome
from concealed.scoring.breakdown import arm_of, cell, counts, effect_of, named, single, strength_of
from concealed.scoring.figures import Figure, Standing, headline

HERE = Path(__file__).parent
REASONS = HERE / "reasons.yaml"
WORDS = {
    "headline": "Every share with its 95 % interval",
    "by-strength": "Truth within a finding's set, by effect and strength s",
    "by-arm": "Truth within a finding's set, by effect and arm",
    "confusion": "What was concealed, and the effect of the first finding",
    "calibration": "What findings claim, and how many of them are right; beside each point the number of findings",
    "coverage": "95 % intervals that hold the concealed parameter, by effect and parameter",
    "set-size": "Effects in a set that holds the truth",
    "oracle": "Held-out residual beside that of a diagnosis which knows the form and only fits it",
    "time": "Time of a diagnosis by arm",
    "baselines": "The first choice of every method",
}


def write_page(everything: Sequence[Outcome], page: Path, command: str, planned: int | None = None) -> list[Path]:
    """Write the page and its pictures beside it; the files written.

    `planned` is the number of trials of the whole set, where that is more than there are outcomes of yet.
    """
    outcomes = [each for each in everything if each["series"] in SERIES]
    figures = headline(outcomes)
    folder = page.parent / "images" / "proof"
    drawn = draw_all(outcomes, figures, folder)
    pictures = defaultdict(str, {name: f"![{WORDS[name]}](images/proof/{name}.svg)" for name in drawn})
    series = Counter(each["series"] for each in outcomes)
    seeds = [each["seed"] for each in outcomes]
    days = sorted({each["began"][:10] for each in outcomes})
    commits = Counter(each["commit"] or "unknown" for each in outcomes)
    environment = Environment(
        loader=FileSystemLoader(HERE), undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    text = environment.get_template("page.md.jinja").render(
        command=command,
        outcomes=outcomes,
        planned=planned or len(outcomes),
        first_seed=min(seeds),
        last_seed=max(seeds),
        commits=", ".join(f"commit {name} ({count} trials)" for name, count in commits.items()),
        days=" to ".join(dict.fromkeys([days[0], days[-1]])),
        series=[(name, told.words, series[name]) for name, told in SERIES.items() if series[name]],
        overview=overview(everything),
        figures="\n".join(_row(each) for each in figures if each.count),
        pictures=pictures,
        below=_below(figures),
        baselines=table(outcomes),
        ranked=len(ranked(outcomes)),
        real=real_table(everything),
        effects=_effects(outcomes),
        failures=_failures(outcomes),
    )
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(re.sub(r"\n{3,}", "\n\n", text), encoding="utf-8")
    return [page, *(folder / f"{name}.svg" for name in drawn)]


def _row(each: Figure) -> str:
    interval = f"{_number(each, each.low)} to {_number(each, each.high)}"
    return f"| {each.words} | {_target(each)} | {_value(each)} | {interval} | {each.standing or ''} |"


def _target(each: Figure) -> str:
    if each.target is None:
        return ""
    return f"{'≥' if each.at_least else '≤'} {_number(each, each.target)}"


def _value(each: Figure) -> str:
    if each.hits is None:
        return f"{_number(each, each.value)} (n = {each.count})"
    return f"{_number(each, each.value)} ({each.hits} of {each.count})"


def _number(each: Figure, value: float) -> str:
    if each.hits is None:
        return f"{value:.3f}" if each.target is not None else f"{value:.2f}"
    return f"{100.0 * value:.3g} %"


def _below(figures: Sequence[Figure]) -> str:
    """Every figure below its target with its reason."""
    reasons = YAML(typ="safe").load(REASONS.read_text(encoding="utf-8")) or {}
    told = [
        f"- **{each.words}** ({_value(each)}, asked {_target(each)}): "
        + str(reasons.get(each.id, "nobody has looked into it yet.")).strip()
        for each in figures
        if each.standing in (Standing.SHORT, Standing.MISSED)
    ]
    return "\n".join(told) or "Nothing that was tried here."


def _effects(outcomes: Sequence[Outcome]) -> str:
    """One effect of the catalogue on good motion: truth within a set, as a table."""
    these = single(outcomes)
    strengths = sorted({strength_of(each) for each in these})
    arms = sorted({arm_of(each) for each in these})
    by_strength = counts(these, lambda each: (effect_of(each), strength_of(each)), named)
    by_arm = counts(these, lambda each: (effect_of(each), arm_of(each)), named)
    lines = [["effect", *(f"s = {s:g}" for s in strengths), *arms], ["---"] * (1 + len(strengths) + len(arms))]
    for effect in sorted({effect_of(each) for each in these}):
        cells = [by_strength.get((effect, s)) for s in strengths] + [by_arm.get((effect, arm)) for arm in arms]
        lines.append([f"`{effect}`", *(cell(each) for each in cells)])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _failures(outcomes: Sequence[Outcome]) -> str:
    """Every trial that did not go as it should."""
    rows = [_failure(each) for each in outcomes if not _went_well(each)]
    if not rows:
        return "None."
    return "\n".join(
        [
            f"{len(rows)} of {len(outcomes)} trials: an effect named on a sound arm, the truth in no finding's set,"
            " something named that is not there, a law of no catalogue passed for one that is, or an error.",
            "",
            "| trial | concealed | s | verdict | findings with probability and {equivalents} |",
            "|---|---|---|---|---|",
            *rows,
        ]
    )


def _went_well(each: Outcome) -> bool:
    if "score" not in each:
        return False
    score = each["again"] if "again" in each else each["score"]
    if each["series"].startswith("sound"):
        return not score["claimed"]
    if each["series"] == "unknown":
        return score["verdict"] in ("partly_explained", "unexplained") and not score["extra"]
    return bool(score["named"]) and not score["extra"]


def _failure(each: Outcome) -> str:
    if "score" not in each:
        return f"| {each['series']} {each['seed']} | | | error | {each['error'][:160].replace('|', '/')} |"
    score = each["again"] if "again" in each else each["score"]
    places = ", ".join(
        what if what == SIGNS else f"{what} of joint {joint + 1}" for what, joint in each["case"]["places"]
    )
    told = "; ".join(score["told"]) or "none"
    return f"| {each['name']} | {places or 'nothing'} | {each['score']['strength']:.0f} | {score['verdict']} | {told} |"
