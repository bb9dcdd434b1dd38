"""LS (16), (17) and WLS (18), (19) from orthogonal factors, in constant memory.

Each joint's rows [A_j | y_j] are reduced to their triangular factor R_j piece by piece (sequential QR): the same sums
as the normal equations without squaring the condition number. Weights scale R_j, so LS, WLS and every reweighting
between them need one pass over the data.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular

from tauscope.errors import IdentificationError
from tauscope.identification.dataset import PreparedMotion
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

# Singular values of the column-scaled factor below this share of the largest are directions without information.
RANK_TOLERANCE = 1e-9
# Reciprocal condition (1-norm) of a factor above which no direction can lack information: the ratio of the singular
# values is at least that over the number of columns.
WELL_CONDITIONED = 1e-6
ROWS_AT_ONCE = 1 << 10  # rows factorised at once: such a block stays in the processor's cache
PANEL = 8  # columns that are eliminated before the rest is updated by one matrix product


@dataclass(frozen=True, eq=False)
class JointFactor:
    """Triangular factor R_j, (p_j + 1, p_j + 1), of [A_j | y_j]; `columns`: (p_j,) int, their global places."""

    columns: NDArray[np.intp]
    triangle: Array
    rows: int

    @cached_property
    def least_squared_residual(self) -> float:
        """‖A_j Θ_j - y_j‖² of the joint solved alone: R_j's last entry, squared, unless rounding decides it."""
        columns, target = self.triangle[:, :-1], self.triangle[:, -1]
        if _is_well_conditioned(columns[:-1]):
            return float(target[-1] ** 2)
        solution = np.linalg.lstsq(columns, target, rcond=RANK_TOLERANCE)[0]
        return float(np.sum((columns @ solution - target) ** 2))

    def squared_residual(self, parameters: Array) -> float:
        """‖A_j Θ - y_j‖². `parameters`: (p,), all parameters of the model."""
        own = np.append(parameters[self.columns], -1.0)
        return float(np.sum((self.triangle @ own) ** 2))


@dataclass(frozen=True, eq=False)
class Solution:
    """A least-squares estimate."""

    parameters: Array  # (p,), Θ; where a direction has no information, its smallest value
    factor: Array  # (p, p), R of the weighted equations
    target: Array  # (p,), z, so that the criterion is ‖R Θ - z‖² and a constant
    spread: Array  # (p, r), S with S Sᵀ = (Lᵀ W L)⁺, r the rank
    undetermined: NDArray[np.bool_]  # (p,), parameters that take part in a direction without information


def factorise(motions: Iterable[PreparedMotion], structure: ModelStructure) -> tuple[JointFactor, ...]:
    """Triangular factors by one pass over the data. Raises IdentificationError for a joint of too few rows."""
    joints = range(structure.robot.joint_count)
    columns = [structure.joint_columns(joint) for joint in joints]
    triangles = [np.zeros((len(own) + 1, len(own) + 1), order="F") for own in columns]
    rows = [0] * len(columns)
    for prepared in motions:
        for joint in joints:
            equations = *prepared.joint_column_groups(structure, joint), prepared.reduced_torque[None, joint]
            white = [prepared.whiten(joint, columns) for columns in equations]
            _append(triangles[joint], white, prepared.used[joint])
            rows[joint] += int(prepared.used[joint].sum())
    factors = []
    for joint in joints:
        if rows[joint] <= len(columns[joint]):
            name = structure.robot.joints[joint].name
            raise IdentificationError(
                f"{name}: {rows[joint]} usable samples for {len(columns[joint])} parameters: record longer, or ask for"
                " a higher cut-off"
            )
        factors.append(JointFactor(columns[joint], triangles[joint], rows[joint]))
    return tuple(factors)


def solve(factors: tuple[JointFactor, ...], size: int, noise_std: Array) -> Solution:
    """Θ = argmin Σ_j ‖A_j Θ - y_j‖² / σ_j²; `noise_std`: (n,), σ_j, all ones for LS."""
    triangle = stacked_factor(factors, size, noise_std)
    return _solve(triangle[:size, :size], triangle[:size, size])


def stacked_factor(factors: tuple[JointFactor, ...], size: int, noise_std: Array) -> Array:
    """Triangular factor of all equations, each divided by its σ_j of `noise_std` (n,): (p + 1, p + 1)."""
    stacked = np.zeros((sum(len(factor.triangle) for factor in factors), size + 1))
    row = 0
    for factor, std in zip(factors, noise_std, strict=True):
        block = slice(row, row + len(factor.triangle))
        stacked[block, factor.columns] = factor.triangle[:, :-1] / std
        stacked[block, size] = factor.triangle[:, -1] / std
        row += len(factor.triangle)
    return _triangle(stacked)


def restrict(factors: tuple[JointFactor, ...], keep: NDArray[np.intp]) -> tuple[JointFactor, ...]:
    """The factors of the columns `keep`, (k,) int, ascending and numbered anew, without another pass over the data."""
    position = np.full(max(int(factor.columns.max()) for factor in factors) + 1, -1)
    position[keep] = np.arange(len(keep))
    smaller = []
    for factor in factors:
        stays = np.flatnonzero(position[factor.columns] >= 0)
        triangle = factor.triangle[:, np.append(stays, len(factor.columns))]
        smaller.append(JointFactor(position[factor.columns[stays]], _triangle(triangle), factor.rows))
    return tuple(smaller)


def condition_number(factors: tuple[JointFactor, ...], size: int) -> float:
    """Condition number of a regressor: largest over smallest singular value, at most 1/ε: more is rounding."""
    unweighted = stacked_factor(factors, size, np.ones(len(factors)))[:size, :size]
    singular = np.linalg.svd(unweighted, compute_uv=False)
    return float(singular[0] / max(singular[-1], singular[0] * np.finfo(float).eps, np.finfo(float).tiny))


def _append(triangle: Array, equations: Sequence[Array], used: NDArray[np.bool_]) -> None:
    """Replace R, in place, by that of the rows so far and of new ones: groups of columns (k, M) with time last."""
    whole = bool(used.all())
    for start in range(0, len(used), ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        block = np.concatenate([columns[:, rows] for columns in equations])
        if not whole:
            block = block[:, used[rows]]
        if block.size:
            panel = min(PANEL, len(triangle))
            triangle[:], *_ = lapack.dtpqrt(0, panel, triangle, block.T, overwrite_a=True, overwrite_b=True)


def _triangle(matrix: Array) -> Array:
    """R of the QR factorisation, square, with rows of zeros where there are fewer rows than columns."""
    upper = np.asarray(np.linalg.qr(matrix, mode="r"))
    columns = matrix.shape[1]
    if len(upper) == columns:
        return upper
    return np.vstack([upper, np.zeros((columns - len(upper), columns))])


def _is_well_conditioned(triangle: Array) -> bool:
    """Whether every direction holds information beyond doubt; costs a fraction of singular values."""
    return bool(lapack.dtrcon(triangle)[0] > WELL_CONDITIONED)


def _solve(factor: Array, target: Array) -> Solution:
    """Minimum-norm solution in scaled columns."""
    scale = np.linalg.norm(factor, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = factor / scale
    if _is_well_conditioned(scaled):
        inverse = solve_triangular(scaled, np.eye(len(scale))) / scale[:, None]
        return Solution(inverse @ target, factor, target, inverse, np.zeros(len(scale), dtype=bool))
    left, singular, right = np.linalg.svd(scaled)
    known = singular > RANK_TOLERANCE * max(singular[0], np.finfo(float).tiny)
    spread = right[known].T / singular[known] / scale[:, None]
    undetermined = np.any(np.abs(right[~known]) > 1e-3, axis=0)
    return Solution(spread @ (left[:, known].T @ target), factor, target, spread, np.asarray(undetermined))


# Rounds of estimating σ_j from the common solution's residual, after a first one from each joint alone.
REWEIGHTINGS = 1
SMALLEST_TORQUE = 1e-9  # torque below which a recording has none [Nm or N]
# Share of a joint's torque that counts as its noise at least: no sensor resolves more, and weights stay finite.
FINEST_TORQUE = 1e-6
# Share of the arm's largest torque by which a joint without torque breaks its equation at least: a link of nothing
# would keep it exactly, and so be certain.
PASSIVE_TORQUE = 1e-2


class Estimator(StrEnum):
    """How the joints' equations are weighted."""

    LS = "ls"
    WLS = "wls"


def estimate(factors: tuple[JointFactor, ...], size: int, estimator: Estimator) -> tuple[Array, Solution]:
    """Weights 1/σ_j, (n,), and the solution of LS, or of WLS with σ_j by the residual of LS."""
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
    """σ_j with the degrees of freedom that the parameters took, shared by rows; never below `least_std`."""
    total = sum(factor.rows for factor in factors)
    freedom = np.array([factor.rows * max(1.0 - size / total, 1e-3) for factor in factors])
    return np.maximum(np.sqrt(np.array(squares) / freedom), least_std(factors))


def torque_rms(factors: tuple[JointFactor, ...]) -> Array:
    """Root mean square of each joint's torque, (n,); the arm's largest at a passive joint, which has none."""
    return _measure_torque(factors)[0]


def least_std(factors: tuple[JointFactor, ...]) -> Array:
    """σ_j that no joint falls below, (n,)."""
    rms, is_passive = _measure_torque(factors)
    return np.where(is_passive, PASSIVE_TORQUE, FINEST_TORQUE) * rms


def _measure_torque(factors: tuple[JointFactor, ...]) -> tuple[Array, NDArray[np.bool_]]:
    rms = np.array([np.linalg.norm(factor.triangle[:, -1]) / np.sqrt(factor.rows) for factor in factors])
    largest = max(float(rms.max()), SMALLEST_TORQUE)
    is_passive = np.asarray(rms <= FINEST_TORQUE * largest)
    return np.where(is_passive, largest, rms), is_passive
