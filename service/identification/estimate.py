"""LS (17) and WLS (19): the joints' noise estimated from the residual, and the equations solved with it."""

from enum import StrEnum

import numpy as np

from service.identification.least_squares import JointFactor, Solution, solve
from service.recording.recording import Array

REWEIGHTINGS = 2
"""Rounds of estimating σ_j from the residual and solving again; it settles in two."""

FINEST_TORQUE = 1e-6
"""Share of a joint's torque that counts as its noise at least: no sensor resolves more, and weights stay finite."""


class Estimator(StrEnum):
    """How the joints' equations are weighted."""

    LS = "ls"
    WLS = "wls"


def estimate(factors: tuple[JointFactor, ...], size: int, estimator: Estimator) -> tuple[Array, Solution, Solution]:
    """LS, or WLS with σ_j estimated from the residual and the equations solved again.

    Parameters
    ----------
    factors : tuple of JointFactor
        one a joint
    size : int
        number of parameters p
    estimator : Estimator
        how the joints are weighted

    Returns
    -------
    tuple of (n,) float64, Solution and Solution
        weights 1/σ_j (ones for LS), the solution, and that of LS
    """
    std = np.ones(len(factors))
    solution = unweighted = solve(factors, size, std)
    if estimator is Estimator.WLS:
        for _ in range(REWEIGHTINGS):
            std = _residual_std(factors, size, solution.parameters)
            solution = solve(factors, size, std)
    return 1.0 / std, solution, unweighted


def _residual_std(factors: tuple[JointFactor, ...], size: int, parameters: Array) -> Array:
    """σ_j with the degrees of freedom that the parameters took, shared by rows; never below `FINEST_TORQUE`."""
    total = sum(factor.rows for factor in factors)
    squares = np.array([factor.squared_residual(parameters) for factor in factors])
    freedom = np.array([factor.rows * max(1.0 - size / total, 1e-3) for factor in factors])
    torque = np.sqrt([np.sum(factor.triangle[:, -1] ** 2) / factor.rows for factor in factors])
    finest = FINEST_TORQUE * np.maximum(torque, FINEST_TORQUE * torque.max()) + np.finfo(float).tiny
    return np.maximum(np.sqrt(squares / freedom), finest)
