"""The figures of the proof: what was asked, what was measured, and how sure that is."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy import stats

from concealed.running.kept import Outcome
from concealed.scoring.calibration import calibration_error, calibration_interval, claims
from concealed.scoring.score import Parameter

LEVEL = 0.95
CONFIDENT = 0.9
AS_ORACLE = 1.05
"""Ratio of held-out residuals up to which a diagnosis predicts as well as one that knows the form."""

NAMED_SINGLE = ("moderate", "strong", "constant")
POOR_SINGLE = ("strong-sensing", "strong-coarse")
POOR_SERIES = ("sound-sensing", "sound-coarse", *POOR_SINGLE, "sound-poor", "poor", "sign-poor")
COMPARED = frozenset(
    {"weak", "moderate", "strong", "pair", "triple", "constant", "event", "pair-one-joint", "drift-beside", "poor"}
    | set(POOR_SINGLE)
)
"""Series whose truth has a form in the catalogue, so that an oracle can know it."""


class Standing(StrEnum):
    """Where a figure stands against its target."""

    SHOWN = "shown"
    MET = "met"
    SHORT = "short"
    MISSED = "missed"


@dataclass(frozen=True)
class Figure:
    """One figure.

    id : str
        under which its reason is written where it falls short
    words : str
        what is counted
    value, low, high : float
        measured, and its 95 % interval
    count : int
        trials, findings or parameters
    hits : int or None
        of them; None where the figure is no share
    target : float or None
        what was asked
    at_least : bool
        whether more is better
    """

    id: str
    words: str
    value: float
    low: float
    high: float
    count: int
    hits: int | None
    target: float | None = None
    at_least: bool = True

    @property
    def standing(self) -> Standing | None:
        """Shown where the whole interval is on the right side, missed where all of it is on the wrong one."""
        if self.target is None or not self.count:
            return None
        sign = 1.0 if self.at_least else -1.0
        worst, best = sorted((sign * (self.low - self.target), sign * (self.high - self.target)))
        if sign * (self.value - self.target) >= 0.0:
            return Standing.SHOWN if worst >= 0.0 else Standing.MET
        return Standing.SHORT if best >= 0.0 else Standing.MISSED


def share(id_: str, words: str, hits: Iterable[bool], target: float | None = None, *, at_least: bool = True) -> Figure:
    """A share with the interval of Clopper and Pearson (1934)."""
    told = [bool(hit) for hit in hits]
    if not told:
        return Figure(id_, words, float("nan"), 0.0, 1.0, 0, 0, target, at_least)
    low, high = interval(sum(told), len(told))
    return Figure(id_, words, sum(told) / len(told), low, high, len(told), sum(told), target, at_least)


def interval(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a chance of which `hits` of `count` were seen."""
    found = stats.binomtest(hits, count).proportion_ci(LEVEL)
    return float(found.low), float(found.high)


@dataclass(frozen=True)
class Asked:
    """A share of the trials of some series.

    id, words, target, at_least
        of its figure
    series : tuple of str
        whose trials count
    counts : callable
        whether a trial does
    among : callable
        which trials are asked at all
    fault : bool
        whether what counts is a fault; a trial that failed is one, and does nothing well either
    """

    id: str
    words: str
    series: tuple[str, ...]
    counts: Callable[[Outcome], bool]
    target: float | None = None
    at_least: bool = True
    among: Callable[[Outcome], bool] = lambda each: True
    fault: bool = False

    def measured(self, outcomes: Sequence[Outcome]) -> Figure:
        """The figure on some trials."""
        own = [each for each in outcomes if each["series"] in self.series and self.among(each)]
        hits = [self.counts(each) if "score" in each else self.fault for each in own]
        return share(self.id, self.words, hits, self.target, at_least=self.at_least)


def headline(outcomes: Sequence[Outcome]) -> list[Figure]:
    """All figures of a set; failed trials count as misses of their series."""
    hidden = [each for each in outcomes if not each["series"].startswith("sound")]
    return [
        *(asked.measured(outcomes) for asked in ASKED),
        _calibration(outcomes),
        share("coverage", "95 % intervals that hold the parameter", (p.inside for p in parameters(outcomes)), 0.95),
        share(
            "oracle",
            f"held-out rms ≤ {AS_ORACLE} of a diagnosis that knows the form",
            [each.get("oracle_ratio", np.inf) <= AS_ORACLE for each in outcomes if _has_oracle(each)],
        ),
        _count_promised("promised", PROMISED, outcomes, poor=False),
        _count_promised("promised-poor", f"{PROMISED}, poor recordings", outcomes, poor=True),
        share("failed", "trials that ended in an error", ["error" in each for each in outcomes], 0.0, at_least=False),
        _mean("size", "effects in a set that holds the truth (mean)", sizes(hidden)),
        _mean("time", "time of a diagnosis [s] (mean)", [each["seconds"] for each in outcomes if "seconds" in each]),
    ]


def done(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Trials that ended in a diagnosis."""
    return [each for each in outcomes if "score" in each]


def parameters(outcomes: Sequence[Outcome]) -> list[Parameter]:
    """Parameters of findings that are right, beside the truth."""
    return [Parameter(**told) for each in done(outcomes) for told in each["score"]["parameters"]]


def sizes(outcomes: Sequence[Outcome]) -> list[float]:
    """Mean size of each trial's sets that hold a truth."""
    found = [each["score"]["size"] for each in done(outcomes)]
    return [size for size in found if np.isfinite(size)]


def _key(name: str) -> Callable[[Outcome], bool]:
    return lambda each: bool(each["score"][name])


def _claimed(each: Outcome) -> bool:
    return bool(each["score"]["claimed"])


def _extra(each: Outcome) -> bool:
    return bool(each["score"]["extra"])


def _admitted(each: Outcome) -> bool:
    return each["score"]["verdict"] in ("partly_explained", "unexplained")


def _again(each: Outcome) -> bool:
    return bool(each["again" if "again" in each else "score"]["named"])


def _confident_and_wrong(each: Outcome) -> bool:
    return any(p > CONFIDENT and not right for p, right in each["score"]["probabilities"])


def _calibration(outcomes: Sequence[Outcome]) -> Figure:
    trials = claims(done(outcomes))
    findings = [claim for trial in trials for claim in trial]
    words = "expected calibration error of `probability`"
    if not findings:
        return Figure("calibration", words, float("nan"), 0.0, 1.0, 0, None, 0.05, at_least=False)
    low, high = calibration_interval(trials)
    return Figure(
        "calibration", words, calibration_error(findings), low, high, len(findings), None, 0.05, at_least=False
    )


def _mean(id_: str, words: str, values: Sequence[float]) -> Figure:
    """A mean with its interval by Student's t."""
    count = len(values)
    if count < 2:
        return Figure(id_, words, float(np.mean(values)) if count else float("nan"), 0.0, np.inf, count, None)
    mean, half = float(np.mean(values)), float(stats.t.ppf(0.5 + LEVEL / 2.0, count - 1) * stats.sem(values))
    return Figure(id_, words, mean, mean - half, mean + half, count, None)


def _count_promised(id_: str, words: str, outcomes: Sequence[Outcome], *, poor: bool) -> Figure:
    """How often something is said to be there where the diagnosis would see the concealed size by its own word."""
    these = [each for each in done(outcomes) if (each["series"] in POOR_SERIES) == poor]
    return share(id_, words, [kept for each in these for kept in each["score"].get("promised", ())], 0.85)


def _has_oracle(each: Outcome) -> bool:
    """Whether a trial was compared with an oracle, or failed where it should have been."""
    return "oracle_ratio" in each or ("error" in each and each["series"] in COMPARED)


def _not_named(each: Outcome) -> bool:
    return "score" not in each or not each["score"]["named"]


def _wrong_instead(each: Outcome) -> bool:
    return _confident_and_wrong(each) and _not_named(each)


PROMISED = "effects called detectable at their size: something is said to be there"
GOOD, POOR = "one effect, s ≥ 15", "the same, poor recordings"
NOTHING = "nothing of the catalogue"
PARTLY = "told as partly explained or unexplained"
STEPWISE = "jogs or points, poor sensors"
WRONG = f"name with p > {CONFIDENT}"

ASKED: tuple[Asked, ...] = (
    Asked("sound", "sound arms: an effect is named", ("sound",), _claimed, 0.01, at_least=False, fault=True),
    Asked(
        "sound-poor",
        "sound arms, poor recordings: an effect is named",
        ("sound-sensing", "sound-coarse"),
        _claimed,
        0.01,
        at_least=False,
        fault=True,
    ),
    Asked("weak", "one effect, s = 8: detected", ("weak",), _key("detected"), 0.90),
    Asked("detected", f"{GOOD}: detected", NAMED_SINGLE, _key("detected")),
    Asked("located", f"{GOOD}: the largest mismatch is at its joint", NAMED_SINGLE, _key("located")),
    Asked("named", f"{GOOD}: truth within a finding's set", NAMED_SINGLE, _key("named"), 0.95),
    Asked("joint", f"{GOOD}: its joint is right", NAMED_SINGLE, _key("placed"), 0.99),
    Asked("first", f"{GOOD}: truth is the first choice", NAMED_SINGLE, _key("first")),
    Asked("extra", f"{GOOD}: something else is named beside", NAMED_SINGLE, _extra, fault=True),
    Asked("named-poor", f"{POOR}: truth within a set", POOR_SINGLE, _key("named"), 0.95),
    Asked("joint-poor", f"{POOR}: its joint is right", POOR_SINGLE, _key("placed"), 0.99),
    Asked("event", "something that happens for a while: truth within a set", ("event",), _key("named")),
    Asked(
        "sound-stepwise",
        f"sound arms, {STEPWISE}: an effect is named",
        ("sound-poor",),
        _claimed,
        0.01,
        at_least=False,
        fault=True,
    ),
    Asked("stepwise", f"one effect, {STEPWISE}: detected", ("poor",), _key("detected")),
    Asked("stepwise-named", f"one effect, {STEPWISE}: truth within a set", ("poor",), _key("named")),
    Asked("stepwise-joint", f"one effect, {STEPWISE}: its joint is right", ("poor",), _key("placed")),
    Asked("stepwise-wrong", f"one effect, {STEPWISE}: a wrong {WRONG}", ("poor",), _confident_and_wrong, fault=True),
    Asked("sign", "a wrong sign: within a set", ("sign",), _key("named")),
    Asked("sign-stepwise", f"a wrong sign, {STEPWISE}: within a set", ("sign-poor",), _key("named")),
    Asked("pair-one-joint", "two effects at one joint: both within sets", ("pair-one-joint",), _key("named")),
    Asked("drift-beside", "drift beside another effect: both within sets", ("drift-beside",), _key("named")),
    Asked("pair", "two effects: both within sets", ("pair",), _key("named"), 0.90),
    Asked("triple", "three effects: all within sets", ("triple",), _key("named")),
    Asked("form", "another formula than the catalogue's: right family", ("form",), _key("named"), 0.85),
    Asked("form-partly", f"another formula, not named: {PARTLY}", ("form",), _admitted, 1.0, among=_not_named),
    Asked(
        "form-wrong",
        f"another formula: a wrong {WRONG}",
        ("form",),
        _confident_and_wrong,
        0.03,
        at_least=False,
        fault=True,
    ),
    Asked("form-instead", "… and the right family is not among the findings", ("form",), _wrong_instead, fault=True),
    Asked("unknown", f"{NOTHING}: {PARTLY}", ("unknown",), _admitted, 0.90),
    Asked("unknown-located", f"{NOTHING}: the largest mismatch is at its joint", ("unknown",), _key("located"), 0.90),
    Asked("unknown-wrong", f"{NOTHING}: a {WRONG}", ("unknown",), _confident_and_wrong, fault=True),
    Asked("aliased", "motion that hides the effect: within a set", ("aliased",), _key("named")),
    Asked("aliased-again", "… with the recommended motion recorded too", ("aliased",), _again, 0.90),
)
"""What is asked of the diagnosis, in the order of the page."""
