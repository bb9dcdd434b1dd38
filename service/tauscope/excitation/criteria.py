"""What makes an excitation good: functions of the information matrix A = LᵀL, small where it is good.

L is the regressor of all samples, base parameters and friction, its rows divided by the expected noise where that is
known. All three are taken through A's eigenvalues λ, and minimised as logarithms, which are far closer to quadratic.

A condition number sees the extreme eigenvalues only: of motions that it hardly tells apart, one may tell far more about
all other parameters. A share of -ln det(A)/p beside it decides between them, and makes the way there smoother.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Share of the largest eigenvalue below which an eigenvalue is rounding: some parameter is not excited at all.
SINGULAR = 1e-13


class Criterion(StrEnum):
    """What the optimiser minimises."""

    COND_F = "cond-f"
    """Cond_F(LᵀL) = ‖LᵀL‖_F ‖(LᵀL)⁻¹‖_F, the seed paper's equation (20)."""
    LOG_DET = "log-det"
    """-ln det(LᵀL) / p: the volume of the parameters' confidence ellipsoid (D-optimal); no matter in which units."""
    COND_2 = "cond-2"
    """Condition number of L in the 2-norm, σ_max / σ_min."""


@dataclass(frozen=True, eq=False)
class CriterionValue:
    """A criterion at one information matrix.

    `gradient`: (p, p), derivative of `cost` by A, symmetric.
    """

    own: float
    cost: float
    gradient: Array
    condition_number: float


def criterion_value(criterion: Criterion, information: Array, information_weight: float = 0.0) -> CriterionValue:
    """A criterion, its gradient, and the condition number, from one eigenvalue decomposition.

    `information`: (p, p), A = LᵀL, symmetric.
    """
    values, vectors = np.linalg.eigh(information)
    low, high = float(values[0]), float(values[-1])
    if not low > SINGULAR * high:
        return CriterionValue(np.inf, np.inf, np.zeros_like(information), np.inf)
    condition_number = float(np.sqrt(high / low))
    volume, volume_slope = -float(np.mean(np.log(values))), -1.0 / (len(values) * values)
    if criterion is Criterion.LOG_DET:
        return CriterionValue(volume, volume, (vectors * volume_slope) @ vectors.T, condition_number)
    if criterion is Criterion.COND_F:
        size, inverse_size = float(np.sum(values**2)), float(np.sum(values**-2))
        own = 0.5 * float(np.log(size) + np.log(inverse_size))
        slope = values / size - values**-3 / inverse_size
    else:
        own = float(np.log(condition_number))
        slope = np.zeros_like(values)
        slope[0], slope[-1] = -0.5 / low, 0.5 / high
    slope += information_weight * volume_slope
    cost = own + information_weight * volume
    return CriterionValue(own, cost, (vectors * slope) @ vectors.T, condition_number)


def reported_value(criterion: Criterion, own: float) -> float:
    """The criterion as it is known, its logarithm undone, except for ``log-det``."""
    return own if criterion is Criterion.LOG_DET else float(np.exp(own))
