"""The baselines beside Tauscope, on the same trials."""

from collections.abc import Callable, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from concealed.baselines.claims import BASELINES, NAMES, Claim, balanced, claim, claim_of_tauscope, right, thresholds
from concealed.running.kept import Outcome
from concealed.scoring.breakdown import Count, cell
from concealed.scoring.figures import interval

GROUPS = {
    "sound: nothing claimed": ("sound",),
    "sound, poor recordings": ("sound-sensing", "sound-coarse"),
    "s = 8": ("weak",),
    "s ≥ 15": ("moderate", "strong", "constant"),
    "poor recordings": ("strong-sensing", "strong-coarse"),
    "other formula": ("form",),
    "no catalogue has it: nothing claimed": ("unknown",),
}
"""Series in which the first choice can be right, or it is right to claim nothing."""

RANKED = frozenset(series for group in GROUPS.values() for series in group)
"""All of them."""

COLOURS = {"tauscope": "#0072B2", "bic": "#E69F00", "sparse": "#009E73", "correlation": "#CC79A7"}
MARKERS = {"tauscope": "o", "bic": "s", "sparse": "D", "correlation": "^"}


def ranked(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Trials that Tauscope and the baselines have both seen."""
    return [each for each in outcomes if "baselines" in each and "score" in each]


def methods() -> dict[str, Callable[[Outcome], Claim]]:
    """What every method claims of an outcome."""
    tuned = thresholds()

    def of(baseline: str) -> Callable[[Outcome], Claim]:
        return lambda each: claim(each["baselines"], baseline, tuned[baseline])

    return {"tauscope": claim_of_tauscope, **{baseline: of(baseline) for baseline in BASELINES}}


def shares(outcomes: Sequence[Outcome]) -> dict[str, dict[str, Count]]:
    """Trials in which a method's first choice is right, by method and group."""
    told: dict[str, dict[str, Count]] = {}
    for method, claims in methods().items():
        told[method] = {}
        for group, series in GROUPS.items():
            these = [each for each in ranked(outcomes) if each["series"] in series]
            if these:
                told[method][group] = sum(is_right(each, claims) for each in these), len(these)
    return told


def is_right(each: Outcome, claims: Callable[[Outcome], Claim]) -> bool:
    """Whether a method's first choice is right on a trial."""
    labels = [hidden["labels"] for hidden in each["truth"]["hidden"] if each["series"] != "unknown"]
    return right(claims(each), labels)


def table(outcomes: Sequence[Outcome]) -> str:
    """The comparison as a table; empty where no trial was ranked."""
    these = ranked(outcomes)
    if not these:
        return ""
    found, tuned = shares(outcomes), thresholds()
    groups = list(next(iter(found.values())))
    lines = [["method, claim from", *groups, "balanced accuracy"], ["---"] * (len(groups) + 2)]
    for method, claims in methods().items():
        limit = f", {tuned[method]:.3g}" if method in tuned else ""
        lines.append([NAMES[method] + limit, *(cell(found[method][g]) for g in groups), _balanced(these, claims)])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _balanced(outcomes: Sequence[Outcome], claims: Callable[[Outcome], Claim]) -> str:
    series = (*GROUPS["sound: nothing claimed"], *GROUPS["s ≥ 15"])
    these = [each for each in outcomes if each["series"] in series]
    sound = [each["series"] == "sound" for each in these]
    if all(sound) or not any(sound):
        return ""
    return f"{balanced([is_right(each, claims) for each in these], sound):.3f}"


def picture(outcomes: Sequence[Outcome]) -> Canvas | None:
    """First choices that are right, with intervals, side by side."""
    if not ranked(outcomes):
        return None
    found = shares(outcomes)
    groups = list(next(iter(found.values())))
    canvas = Canvas(figsize=(7.5, 0.75 * len(groups) + 1.3), layout="constrained")
    axes: Axes = canvas.add_subplot()
    for number, (method, told) in enumerate(found.items()):
        for row, group in enumerate(reversed(groups)):
            hits, count = told[group]
            place = row + 0.27 - 0.18 * number
            axes.plot(interval(hits, count), [place, place], color=COLOURS[method], lw=1.8)
            named = NAMES[method] if row == 0 else None
            axes.plot(hits / count, place, MARKERS[method], color=COLOURS[method], ms=5, label=named)
    axes.set_yticks(range(len(groups)), list(reversed(groups)))
    axes.set(xlim=(-0.02, 1.02), xlabel="share of trials whose first choice is right, 95 % interval")
    axes.grid(axis="x", color="#dddddd", lw=0.6)
    axes.legend(loc="upper center", bbox_to_anchor=(0.4, -0.18), ncols=2, frameon=False)
    return canvas
