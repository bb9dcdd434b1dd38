"""The information that a motion gives about base parameters and friction, its gradient by the motion, and its criteria.

L has the columns of identification: the base parameters' (`tauscope.dynamics`), and for each joint stiction, viscous
friction and an offset, with a Stribeck column where the robot file states δ. Joint j's rows hold zeros for the links
before it and for the friction of others; these are never computed.

L is the regressor of all samples, base parameters and friction, its rows divided by the expected noise where that is
known. All three are taken through A's eigenvalues λ, and minimised as logarithms, which are far closer to quadratic.

A condition number sees the extreme eigenvalues only: of motions that it hardly tells apart, one may tell far more about
all other parameters. A share of -ln det(A)/p beside it decides between them, and makes the way there smoother.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics import BaseParameters
from tauscope.dynamics.friction import smooth_sign
from tauscope.dynamics.regressor import TorqueRegressor
from tauscope.dynamics.regressor_gradient import RegressorGradient
from tauscope.robot import STANDARD_PARAMETERS, Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples

Columns = NDArray[np.intp]

# K_v where the robot file states none [s/rad or s/m]: its sign function turns within a hundredth of usual speeds.
ORDINARY_STEEPNESS = 500.0
APART = 4.0  # k_v is never taken for less than this many δ: the two columns would be one


class ColumnScaling(StrEnum):
    """In which units the parameters are counted; condition numbers depend on it, ``log-det`` does not."""

    NONE = "none"  # SI units, as the seed paper's (20), FIGAROH and `identify` count them
    TYPICAL = "typical"  # each column divided by its rms over random motions within the limits: units fall out


MotionGradient = MotionSamples  # derivatives of a scalar by q, q̇ and q̈ of every sample, (N, n) each


class ExcitationRegressor:
    """The regressor L of a motion, joint by joint, its information matrix and the way back from it.

    `noise_std`: (n,), expected torque noise, by which rows are divided [Nm or N]; equal weights where None.
    `steepest`: (n,), largest K_v of the samples, for gradients [s/rad or s/m]; None for the curve as it is.
    """

    def __init__(
        self,
        robot: Robot,
        base: BaseParameters,
        *,
        capacity: int,
        noise_std: Array | None = None,
        steepest: Array | None = None,
    ) -> None:
        self.joint_count = robot.joint_count
        self.base_columns = base.independent_columns
        self._regressor = TorqueRegressor(robot, columns=self.base_columns, chunk=capacity)
        self._gradient = RegressorGradient(robot, columns=self.base_columns, capacity=capacity)
        self._weight = np.ones(robot.joint_count) if noise_std is None else 1.0 / np.asarray(noise_std)
        self._slopes = [_slopes(robot, joint, steepest) for joint in range(robot.joint_count)]
        first = np.searchsorted(self.base_columns, len(STANDARD_PARAMETERS) * np.array(robot.first_links))
        self.first_columns = [int(place) for place in first]
        """For each joint its first base column that is not always zero."""
        self._columns: list[Columns] = []
        self.column_count = len(self.base_columns)
        for first_own, slopes in zip(self.first_columns, self._slopes, strict=True):
            friction = self.column_count + np.arange(len(slopes) + 2)
            self._columns.append(np.concatenate([np.arange(first_own, len(self.base_columns)), friction]))
            self.column_count += len(friction)

    def base_regressor(self, motion: MotionSamples) -> Array:
        """Columns of the base parameters, (n, m, N): those of links before a joint are not set."""
        out = np.empty((self.joint_count, len(self.base_columns), len(motion.position)))
        self._regressor.write_shares(motion.position, motion.velocity, motion.acceleration, out)
        return out

    def rows(self, motion: MotionSamples, base: Array | None = None) -> list[Array]:
        """L joint by joint: its columns that are not always zero, (C_j, N), weighted; `base`: (n, m, N)."""
        base = self.base_regressor(motion) if base is None else base
        rows = []
        for joint, slopes in enumerate(self._slopes):
            velocity = motion.velocity[:, joint]
            own = base[joint, self.first_columns[joint] :]
            block = np.empty((len(self._columns[joint]), len(velocity)))
            np.multiply(own, self._weight[joint], out=block[: len(own)])
            for place, slope in enumerate(slopes, len(own)):
                block[place] = smooth_sign(velocity, slope) * self._weight[joint]
            block[-2] = velocity * self._weight[joint]
            block[-1] = self._weight[joint]
            rows.append(block)
        return rows

    def information(self, rows: list[Array]) -> Array:
        """A = LᵀL / N, (p, p). `rows`: list of (C_j, N), from `rows`."""
        information = np.zeros((self.column_count, self.column_count))
        for block, columns in zip(rows, self._columns, strict=True):
            information[np.ix_(columns, columns)] += block @ block.T
        return information / rows[0].shape[1]

    def stacked(self, motion: MotionSamples) -> Array:
        """L as one matrix, joint after joint, (n N, p), weighted."""
        count = len(motion.position)
        matrix = np.zeros((self.joint_count * count, self.column_count))
        for joint, (block, columns) in enumerate(zip(self.rows(motion), self._columns, strict=True)):
            matrix[joint * count : (joint + 1) * count, columns] = block.T
        return matrix

    def pull_back(self, motion: MotionSamples, rows: list[Array], by_information: Array) -> MotionGradient:
        """Derivatives of a scalar by the motion from those by A, `by_information`, (p, p), symmetric."""
        count = len(motion.position)
        weight = np.zeros((self.joint_count, len(self.base_columns), count))
        of_velocity = np.zeros_like(motion.velocity)
        for joint, (block, columns) in enumerate(zip(rows, self._columns, strict=True)):
            back = (2.0 * self._weight[joint] / count) * (by_information[np.ix_(columns, columns)] @ block)
            own = len(self.base_columns) - self.first_columns[joint]
            weight[joint, self.first_columns[joint] :] = back[:own]
            velocity = motion.velocity[:, joint]
            for slope, of_column in zip(self._slopes[joint], back[own:], strict=False):
                of_velocity[:, joint] += of_column * (2.0 / np.pi) * slope / (1.0 + (slope * velocity) ** 2)
            of_velocity[:, joint] += back[-2]
        gradient = self.pull_back_base(motion, weight)
        return MotionGradient(gradient.position, gradient.velocity + of_velocity, gradient.acceleration)

    def pull_back_base(self, motion: MotionSamples, weight: Array) -> MotionGradient:
        """Derivatives of a scalar by the motion from those by `base_regressor`, `weight`, (n, m, N)."""
        parts = self._gradient.contract(motion.position, motion.velocity, motion.acceleration, weight)
        return MotionGradient(*parts)


def _slopes(robot: Robot, joint: int, steepest: Array | None) -> tuple[float, ...]:
    shape = robot.joints[joint].friction_shape
    k_v = ORDINARY_STEEPNESS if shape.k_v is None else shape.k_v
    if steepest is not None:
        k_v = min(k_v, max(float(steepest[joint]), APART * (shape.delta or 0.0)))
    return (k_v,) if shape.delta is None else (k_v, shape.delta)


# Share of the largest eigenvalue below which an eigenvalue is rounding: some parameter is not excited at all.
SINGULAR = 1e-13


class Criterion(StrEnum):
    """What the optimiser minimises."""

    COND_F = "cond-f"  # cond_F(LᵀL) = ‖LᵀL‖_F ‖(LᵀL)⁻¹‖_F, the seed paper's equation (20)
    # -ln det(LᵀL) / p: the volume of the parameters' confidence ellipsoid (D-optimal); no matter in which units.
    LOG_DET = "log-det"
    COND_2 = "cond-2"  # condition number of L in the 2-norm, σ_max / σ_min


@dataclass(frozen=True, eq=False)
class CriterionValue:
    """A criterion at one information matrix."""

    own: float
    cost: float
    gradient: Array  # (p, p), derivative of `cost` by A, symmetric
    condition_number: float


def criterion_value(criterion: Criterion, information: Array, information_weight: float = 0.0) -> CriterionValue:
    """A criterion of `information`, A = LᵀL, (p, p), its gradient, and the condition number."""
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
