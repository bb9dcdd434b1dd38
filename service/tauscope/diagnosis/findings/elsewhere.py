"""What a finding's parameters are elsewhere: at other optima that explain nearly as much.

A standard error is the curvature at one optimum. Where another one has the chance p and the value x, a parameter's
variance is σ² + Σ p (x - x̂)².
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.model.term import Term
from tauscope.effects.effect import Quantity


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """The same effect far from where it was found."""

    chance: float
    term: Term


def spread(found: Sequence[Quantity], elsewhere: Sequence[tuple[float, Sequence[Quantity]]]) -> tuple[Quantity, ...]:
    """Parameters with what they are elsewhere in their standard errors; those that are none there stay as they are.

    What was only chosen, and has no standard error, gets none.

    Parameters
    ----------
    elsewhere : sequence of (float, sequence of Quantity)
        chance of another optimum, and the parameters there
    """
    variances = {each.name: each.std**2 for each in found}
    for chance, others in elsewhere:
        there = {each.name: each for each in others}
        for each in found:
            if each.name in there and each.std > 0.0:
                variances[each.name] += chance * _distance(each, there[each.name]) ** 2
    return tuple(replace(each, std=float(np.sqrt(variances[each.name]))) for each in found)


def _distance(one: Quantity, other: Quantity) -> float:
    """Between two values, the shorter way where they lie on a circle."""
    apart = abs(one.value - other.value)
    return apart if np.isinf(one.period) else min(apart % one.period, -apart % one.period)
