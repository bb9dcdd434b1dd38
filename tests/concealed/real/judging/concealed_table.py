"""The trials of effects concealed in real recordings as tables: by size, by kind and by set."""

from collections.abc import Callable, Sequence

import numpy as np

from concealed.real.concealed_outcome import CONCEALED, UNTOUCHED
from concealed.real.judging.judge import Judged, Named, judge, worse_joints
from concealed.running.kept import Outcome

HEAD = (
    "trials",
    "effects",
    "named",
    "first choice",
    "there before",
    "size inside",
    "new wrong names",
    "confident",
    "energy removed: median, mean",
    "joints worse",
    "time [s]",
)


def judge_all(outcomes: Sequence[Outcome]) -> list[tuple[Outcome, Judged]]:
    """All trials that were diagnosed and whose set was diagnosed untouched, each judged beside it."""
    untouched = {each["arm"]: each for each in outcomes if each["series"] == UNTOUCHED and "diagnosis" in each}
    return [
        (each, judge(each, untouched[each["case"]["arm"]]))
        for each in outcomes
        if each["series"] == CONCEALED and "diagnosis" in each and each["case"]["arm"] in untouched
    ]


def concealed_table(outcomes: Sequence[Outcome]) -> str:
    """Tables in Markdown; empty where there is no trial."""
    judged = judge_all(outcomes)
    tried = [each for each in outcomes if each["series"] == CONCEALED]
    if not tried:
        return ""
    plain = [worse_joints(each) for each in outcomes if each["series"] == UNTOUCHED and "diagnosis" in each]
    parts = [
        f"{len(tried)} trials, {len(tried) - len(judged)} of them failed; in {len(plain)} untouched sets"
        f" {sum(len(each) for each in plain)} joints are made worse"
    ]
    groups: tuple[tuple[str, Callable[[Outcome, Named], str]], ...] = (
        ("size", lambda _, one: "a sign" if one.multiple is None else f"{one.multiple:g} ×"),
        ("kind", lambda _, one: one.kind),
        ("set", lambda each, _: str(each["case"]["arm"])),
    )
    for title, group in groups:
        parts += ["", f"| {title} | {' | '.join(HEAD)} |", "|" + "---|" * (len(HEAD) + 1)]
        parts += [_row(name, these) for name, these in _grouped(judged, group)]
    parts.append(_row("all", [(one, told) for _, told in judged for one in told.effects]))
    return "\n".join(parts)


def _grouped(
    judged: Sequence[tuple[Outcome, Judged]], group: Callable[[Outcome, Named], str]
) -> list[tuple[str, list[tuple[Named, Judged]]]]:
    found: dict[str, list[tuple[Named, Judged]]] = {}
    for outcome, told in judged:
        for one in told.effects:
            found.setdefault(group(outcome, one), []).append((one, told))
    return sorted(found.items())


def _row(name: str, these: Sequence[tuple[Named, Judged]]) -> str:
    """Effects count one by one; what is of the whole trial counts once a trial."""
    effects = [one for one, _ in these]
    trials = list({id(told): told for _, told in these}.values())
    sizes = [one.inside for one in effects if one.inside is not None]
    removed = [told.share for told in trials if told.share is not None]
    cells = [
        str(len(trials)),
        str(len(effects)),
        _share([one.named for one in effects]),
        _share([one.first for one in effects]),
        str(sum(one.before for one in effects)),
        _share(sizes),
        f"{sum(len(told.wrong) for told in trials) / max(len(trials), 1):.2f} a trial",
        str(sum(len(told.confident) for told in trials)),
        f"{np.median(removed):.0%}, {np.mean(removed):.0%} of {len(removed)}" if removed else "",
        f"{sum(len(told.worse) for told in trials) / max(len(trials), 1):.2f} a trial",
        f"{np.mean([told.seconds for told in trials]):.0f}" if trials else "",
    ]
    return f"| {name} | {' | '.join(cells)} |"


def _share(hits: Sequence[bool]) -> str:
    return f"{sum(hits)}/{len(hits)} ({sum(hits) / len(hits):.0%})" if hits else ""
