"""Figures by effect, strength and arm, and what each effect was taken for."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from concealed.generator.case import SIGN, SIGNS
from concealed.generator.forms import FORMS
from concealed.running.kept import Outcome
from concealed.scoring.figures import done, interval
from concealed.scoring.score import UNKNOWN

Group = TypeVar("Group", bound=Hashable)
Count = tuple[int, int]
"""Hits, and of how many."""

NOTHING = "nothing"
SINGLE = ("weak", "moderate", "strong", "constant", "event", "strong-sensing", "strong-coarse")


def counts(
    outcomes: Sequence[Outcome], group: Callable[[Outcome], Group], hit: Callable[[Outcome], bool]
) -> dict[Group, Count]:
    """Hits in every group."""
    told: dict[Group, Count] = defaultdict(lambda: (0, 0))
    for each in outcomes:
        hits, count = told[group(each)]
        told[group(each)] = (hits + bool(hit(each)), count + 1)
    return dict(told)


def single(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Trials of one effect of the catalogue on motion that shows it."""
    return [each for each in done(outcomes) if each["series"] in SINGLE]


def effect_of(each: Outcome) -> str:
    """What is concealed: an effect, for a form the first of its family; a law that no catalogue has is unknown."""
    if not each["case"]["places"]:
        return NOTHING
    what = str(each["case"]["places"][0][0])
    if what in (SIGN, SIGNS):
        return "torque_gain_error"
    if what in FORMS:
        return FORMS[what].names[0]
    return UNKNOWN if each["series"] == "unknown" else what


def strength_of(each: Outcome) -> float:
    """s that was asked for."""
    return float(each["case"]["wanted"])


def arm_of(each: Outcome) -> str:
    """The arm's name."""
    return str(each["case"]["arm"])


def named(each: Outcome) -> bool:
    """Truth within a finding's set."""
    return bool(each["score"]["named"])


def said(each: Outcome) -> str:
    """The effect of the first finding, which explains most; nothing or unknown where none is named."""
    told = each["score"]["told"]
    if told:
        return str(told[0].split("@")[0].split(" ")[0])
    return NOTHING if each["score"]["verdict"] == "consistent" else UNKNOWN


def confusion(outcomes: Sequence[Outcome]) -> tuple[list[str], list[str], NDArray[np.intp]]:
    """What is concealed (rows), what is named first (columns), and how often: one effect, form or law, or none."""
    these = [each for each in done(outcomes) if len(each["case"]["places"]) < 2 and each["series"] != "aliased"]
    truths = sorted({effect_of(each) for each in these}, key=_last)
    answers = sorted({*truths, *(said(each) for each in these)}, key=_last)
    table = np.zeros((len(truths), len(answers)), dtype=np.intp)
    for each in these:
        table[truths.index(effect_of(each)), answers.index(said(each))] += 1
    return truths, answers, table


def coverage(outcomes: Sequence[Outcome]) -> dict[str, Count]:
    """Parameters within their 95 % intervals, by effect and parameter."""
    told: dict[str, Count] = defaultdict(lambda: (0, 0))
    for each in done(outcomes):
        effects = "+".join(sorted({str(what) for what, _ in each["case"]["places"]}))
        for parameter in each["score"]["parameters"]:
            inside = abs(parameter["value"] - parameter["truth"]) <= 1.96 * parameter["std"]
            key = f"{effects} {parameter['name']}" if "+" not in effects else f"several: {parameter['name']}"
            hits, count = told[key]
            told[key] = (hits + inside, count + 1)
    return dict(sorted(told.items()))


def cell(count: Count | None) -> str:
    """Hits and trials, and the interval, as a table shows them."""
    if count is None:
        return ""
    low, high = interval(*count)
    return f"{count[0]}/{count[1]} ({100 * low:.0f}–{100 * high:.0f} %)"


def _last(effect: str) -> tuple[bool, str]:
    return effect in (UNKNOWN, NOTHING), effect
