"""Whether a probability means what it says: how often the findings that claim p are right.

The expected calibration error is Σ_b n_b/n |right_b - p_b| over ten bins of equal width (Naeini, Cooper, Hauskrecht,
AAAI 2015); its interval is a percentile bootstrap that draws whole trials, whose findings depend on one another. What
no draw can show, that a fault has not been seen yet, is in the binomial interval of all findings that are right: the
upper end is no lower than that interval allows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from concealed.running.kept import Outcome

BINS = 10
DRAWS = 1000

Claim = tuple[float, bool]
"""Probability of a finding's first choice, and whether it is right."""


@dataclass(frozen=True)
class Bin:
    """Findings whose probabilities are close.

    claimed, right : float
        mean probability, share that is right
    hits, count : int
        findings that are right, all
    """

    claimed: float
    right: float
    hits: int
    count: int


def claims(outcomes: Sequence[Outcome]) -> list[list[Claim]]:
    """The findings of every trial."""
    return [[(float(p), bool(right)) for p, right in each["score"]["probabilities"]] for each in outcomes]


def bins(findings: Sequence[Claim]) -> list[Bin]:
    """Those bins in which there are findings."""
    told = []
    places = [min(int(p * BINS), BINS - 1) for p, _ in findings]
    for place in range(BINS):
        within = [claim for at, claim in zip(places, findings, strict=True) if at == place]
        if within:
            hits = sum(right for _, right in within)
            told.append(Bin(float(np.mean([p for p, _ in within])), hits / len(within), hits, len(within)))
    return told


def calibration_error(findings: Sequence[Claim]) -> float:
    """Expected calibration error; NaN without findings."""
    if not findings:
        return float("nan")
    return sum(each.count * abs(each.right - each.claimed) for each in bins(findings)) / len(findings)


def calibration_interval(trials: Sequence[Sequence[Claim]], seed: int = 0) -> tuple[float, float]:
    """95 % interval of the calibration error."""
    rng = np.random.default_rng(seed)
    drawn = []
    for _ in range(DRAWS):
        some = [claim for place in rng.integers(len(trials), size=len(trials)) for claim in trials[place]]
        drawn.append(calibration_error(some))
    low, high = np.nanquantile(drawn, [0.025, 0.975])
    findings = [claim for trial in trials for claim in trial]
    claimed, right = float(np.mean([p for p, _ in findings])), sum(right for _, right in findings)
    chance = stats.binomtest(right, len(findings)).proportion_ci(0.95)
    return float(low), max(float(high), claimed - float(chance.low), float(chance.high) - claimed)
