"""What a design works with: one robot's limits, predictions and spaces, made once."""

from dataclasses import dataclass, field, replace

import numpy as np

from tauscope.dynamics import BaseParameters, base_parameters
from tauscope.errors import ExcitationError
from tauscope.excitation.constraints import KinematicUsage, StateUsage
from tauscope.excitation.feasibility import Feasibility, require_room
from tauscope.excitation.information import (
    ColumnScaling,
    Criterion,
    CriterionValue,
    ExcitationRegressor,
    criterion_value,
    reported_value,
)
from tauscope.excitation.optimiser import STARTS, Stages
from tauscope.excitation.problem import INFORMATION_WEIGHT, ExcitationProblem, Objective
from tauscope.excitation.series_space import SeriesSpace
from tauscope.excitation.torque_prediction import TorquePrediction
from tauscope.excitation.workspace import Workspace, WorkspaceUsage
from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import FourierSeries, MotionSamples
from tauscope.trajectory.limits import MotionLimits, motion_limits
from tauscope.trajectory.servo_bounds import servo_bounds


@dataclass(frozen=True, eq=False)
class ExcitationOptions:
    """What is wished of an excitation; `noise_std`: (n,), of torque, weights of joints, equal where None."""

    period_s: float = 10.0  # duration of one period [s]
    harmonics: int = 5
    periods: int = 5
    criterion: Criterion = Criterion.COND_F
    scaling: ColumnScaling = ColumnScaling.NONE
    noise_std: Array | None = None
    limit_fraction: float = 0.95
    torque_margin: float = 0.2
    following_error: float | None = None  # distance of a servo from its command [rad or m]; None: 0.2 rad or 0.05 m
    workspace: Workspace = field(default_factory=Workspace)
    slow_postures: int = 3
    closing_period: bool = True
    starts: int = STARTS
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse wishes that mean nothing."""
        wrong = {
            "period_s": not (np.isfinite(self.period_s) and self.period_s > 0.0) and "give a positive duration [s]",
            "harmonics": not 2 <= self.harmonics <= 100 and "give 2 to 100",
            "periods": not 1 <= self.periods <= 10_000 and "give 1 or more",
            "limit_fraction": not 0.0 < self.limit_fraction <= 1.0 and "give a number above 0 and up to 1",
            "torque_margin": not 0.0 <= self.torque_margin < 1.0 and "give a number from 0 to below 1",
            "following_error": not (self.following_error is None or 0.0 < self.following_error < np.inf)
            and "give a positive distance [rad or m]",
            "slow_postures": not 0 <= self.slow_postures <= 60 and "give 0 to 60",
            "starts": not 1 <= self.starts <= 64 and "give 1 to 64",
            "seed": self.seed < 0 and "give 0 or more",
        }
        for name, hint in wrong.items():
            if hint:
                raise ExcitationError(f"{name} is {getattr(self, name)}; {hint}")


# Instants a period of the highest harmonic at which the optimiser looks, first and last: friction's sign asks for more
# than the ten that the rest of the regressor needs.
SAMPLES_PER_HARMONIC = (24, 48)
FINE_SAMPLES_PER_HARMONIC = 80  # instants a period of the highest harmonic at which torque and workspace are held
REPORT_SAMPLES = 2000  # instants a period from which the reported criterion and condition number are computed
EXACT_SAMPLES = 1000  # instants a period from which candidates are compared
# The sign function may turn within this part of the change of speed from instant to instant, as 1/K_v.
RESOLVED_STEPS = 5.0
SCALING_STATES = 512  # random states from which `ColumnScaling.TYPICAL` takes the size of a column


@dataclass(frozen=True, eq=False)
class Setting:
    """One robot's limits, predictions and spaces."""

    robot: Robot
    options: ExcitationOptions
    base: BaseParameters
    stated: MotionLimits
    planned: MotionLimits
    space: SeriesSpace
    states: StateUsage
    feasibility: Feasibility

    @staticmethod
    def of(robot: Robot, options: ExcitationOptions) -> "Setting":
        """Prepare a design. Raises ExcitationError for options that do not fit the robot."""
        noise = np.ones(robot.joint_count) if options.noise_std is None else np.asarray(options.noise_std)
        if noise.shape != (robot.joint_count,) or not (np.isfinite(noise) & (noise > 0.0)).all():
            raise ExcitationError(f"noise_std needs {robot.joint_count} positive numbers, one a joint")
        base = base_parameters(robot)
        stated = motion_limits(robot)
        require_room(robot, stated)
        bounds = servo_bounds(robot, options.following_error).with_limit(stated.torque, 1.0 - options.torque_margin)
        _require_torque(robot, stated, bounds.available[0])
        planned = stated.scaled(options.limit_fraction)
        planned = replace(planned, velocity=np.minimum(planned.velocity, bounds.speed))
        space = SeriesSpace(planned, options.period_s, options.harmonics)
        fine = space.grid(FINE_SAMPLES_PER_HARMONIC * options.harmonics)
        regressor = ExcitationRegressor(robot, base, capacity=REPORT_SAMPLES)
        torque = None
        if robot.model.links is not None:
            torque = TorquePrediction(robot, base, regressor, stated.velocity, bounds)
        workspace = None if options.workspace.is_open else WorkspaceUsage(robot, options.workspace)
        if workspace is not None and not workspace.names:
            workspace = None
        limited = torque if torque is not None and np.isfinite(bounds.available).any() else None
        states = StateUsage(limited, workspace)
        kinematics = KinematicUsage(space, planned)
        feasibility = Feasibility(robot, space, fine, planned, kinematics, states)
        return Setting(robot, options, base, stated, planned, space, states, feasibility)

    def stages(self, rng: np.random.Generator) -> Stages:
        """What the optimiser sees."""
        states = self.states.without_inactive(self.planned, rng)
        scaling = self._scaling()
        coarse, fine = (self._problem(samples, states, scaling) for samples in SAMPLES_PER_HARMONIC)
        return Stages(coarse, fine, lambda x: self._exact(self.space.series(x), EXACT_SAMPLES, scaling))

    def value(self, series: FourierSeries) -> tuple[float, float]:
        """The criterion of a series and its condition number, with friction's curves as they are."""
        motion = _instants(series, REPORT_SAMPLES)
        plain = ExcitationRegressor(self.robot, self.base, capacity=REPORT_SAMPLES)
        condition_number = criterion_value(Criterion.COND_2, plain.information(plain.rows(motion))).condition_number
        own = self._exact(series, REPORT_SAMPLES, self._scaling()).own
        return reported_value(self.options.criterion, own), condition_number

    def _problem(self, samples_per_harmonic: int, states: StateUsage, scaling: Array) -> ExcitationProblem:
        """Criterion and constraints at so many instants a period of the highest harmonic."""
        options = self.options
        grid = self.space.grid(samples_per_harmonic * options.harmonics)
        # Where the sign function turned within one step, its place between two instants would decide, and no gradient.
        top = 2.0 * np.pi * options.harmonics / options.period_s
        step_s = options.period_s / grid.samples
        change = 0.5 * step_s * np.minimum(self.planned.acceleration, 0.5 * top * self.planned.velocity)
        regressor = ExcitationRegressor(
            self.robot, self.base, capacity=grid.samples, noise_std=options.noise_std, steepest=RESOLVED_STEPS / change
        )
        if states.torque is not None:
            states = StateUsage(states.torque.seen_by(regressor), states.workspace)
        objective = Objective(options.criterion, regressor, scaling)
        fine, kinematics = self.feasibility.grid, self.feasibility.kinematics
        return ExcitationProblem(self.space, grid, fine, objective, kinematics, states)

    def _exact(self, series: FourierSeries, samples: int, scaling: Array) -> CriterionValue:
        """The criterion with friction's curves as they are."""
        options = self.options
        regressor = ExcitationRegressor(self.robot, self.base, capacity=samples, noise_std=options.noise_std)
        information = regressor.information(regressor.rows(_instants(series, samples)))
        information /= np.multiply.outer(scaling, scaling)
        return criterion_value(options.criterion, information, INFORMATION_WEIGHT)

    def _scaling(self) -> Array:
        regressor = ExcitationRegressor(
            self.robot, self.base, capacity=SCALING_STATES, noise_std=self.options.noise_std
        )
        if self.options.scaling is ColumnScaling.NONE:
            return np.ones(regressor.column_count)
        rng = np.random.default_rng(self.options.seed)
        states = self.planned.random_states(SCALING_STATES, rng)
        return np.sqrt(np.mean(regressor.stacked(states) ** 2, axis=0) * self.robot.joint_count)


def _instants(series: FourierSeries, samples: int) -> MotionSamples:
    return series.evaluate(np.arange(float(samples)) * (series.period_s / samples))


def _require_torque(robot: Robot, stated: MotionLimits, available: Array) -> None:
    for joint, limit, value in zip(robot.joints, stated.torque, available, strict=True):
        if not value > 0.0:
            raise ExcitationError(
                f"{joint.name}: torque limit {limit:.4g} less the margin leaves {value:.4g}; "
                "lower the margin or raise the limit"
            )
