"""LS (17) and WLS (19): the joints' noise estimated from the residual, and the equations solved with it."""

from enum import StrEnum

import numpy as np

from tauscope.identification.least_squares import JointFactor, Solution, solve
from tauscope.recording.recording import Array

# Rounds of estimating σ_j from the common solution's residual, after a first one from each joint alone.
REWEIGHTINGS = 1
SMALLEST_TORQUE = 1e-9  # torque below which a recording has none [Nm or N]
# Share of a joint's torque that counts as its noise at least: no sensor resolves more, and weights stay finite.
FINEST_TORQUE = 1e-6


class Estimator(StrEnum):
    """How the joints' equations are weighted."""

    LS = "ls"
    WLS = "wls"


def estimate(factors: tuple[JointFactor, ...], size: int, estimator: Estimator) -> tuple[Array, Solution]:
    """LS, or WLS with σ_j estimated from the residual and the equations solved again.

    Returns tuple of (n,) and Solution, weights 1/σ_j (ones for LS), and the solution.
    """
    if estimator is Estimator.LS:
        return np.ones(len(factors)), solve(factors, size, np.ones(len(factors)))
    std = single_joint_std(factors)
    solution = solve(factors, size, std)
    for _ in range(REWEIGHTINGS):
        std = _noise_std(factors, [factor.squared_residual(solution.parameters) for factor in factors], size)
        solution = solve(factors, size, std)
    return 1.0 / std, solution


def single_joint_std(factors: tuple[JointFactor, ...]) -> Array:
    """A first σ_j of every joint: what its own equations leave, solved without the other joints', (n,)."""
    return _noise_std(factors, [factor.least_squared_residual for factor in factors], 0)


def _noise_std(factors: tuple[JointFactor, ...], squares: list[float], size: int) -> Array:
    """σ_j with the degrees of freedom that the parameters took, shared by rows; never below `FINEST_TORQUE`."""
    total = sum(factor.rows for factor in factors)
    freedom = np.array([factor.rows * max(1.0 - size / total, 1e-3) for factor in factors])
    return np.maximum(np.sqrt(np.array(squares) / freedom), FINEST_TORQUE * torque_rms(factors))


def torque_rms(factors: tuple[JointFactor, ...]) -> Array:
    """Root mean square of each joint's torque, (n,); positive also where a joint, or every one, has none."""
    rms = np.sqrt([np.sum(factor.triangle[:, -1] ** 2) / factor.rows for factor in factors])
    return np.maximum(rms, FINEST_TORQUE * max(rms.max(), SMALLEST_TORQUE))
