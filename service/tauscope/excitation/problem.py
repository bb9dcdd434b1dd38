"""The optimisation problem (21): the criterion and the constraints as functions of one vector, with their gradients."""

from dataclasses import dataclass

import numpy as np

from tauscope.excitation.constraints import KinematicUsage, StateUsage
from tauscope.excitation.information import Criterion, CriterionValue, ExcitationRegressor, criterion_value
from tauscope.excitation.series_space import SeriesGrid, SeriesSpace
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples

INFORMATION_WEIGHT = 0.5  # of -log det beside the other criteria


@dataclass(frozen=True, eq=False)
class Objective:
    """What is minimised."""

    criterion: Criterion
    regressor: ExcitationRegressor
    scaling: Array  # (p,), what each column is divided by


@dataclass(frozen=True, eq=False)
class _Evaluation:
    """All that is known at one vector; what costs much is made once."""

    x: Array
    motion: MotionSamples
    base: Array
    rows: list[Array]
    criterion: CriterionValue


class ExcitationProblem:
    """Minimise the criterion's cost subject to all usages being at most 1."""

    def __init__(
        self,
        space: SeriesSpace,
        grid: SeriesGrid,
        fine: SeriesGrid,
        objective: Objective,
        kinematics: KinematicUsage,
        states: StateUsage,
    ) -> None:
        self.shape = (space.joint_count, space.columns)
        self.evaluations = 0
        self._grid = grid
        self._fine = fine
        self.criterion = objective.criterion
        self._objective = objective
        self._regressor = objective.regressor
        self._scaling = np.multiply.outer(objective.scaling, objective.scaling)
        self._kinematics = kinematics
        self._states = states
        self._kinematic_scale = np.ones(3 * space.joint_count)
        self._state_scale = np.ones(len(states.parts))
        self._last: _Evaluation | None = None

    def cost(self, vector: Array) -> float:
        """What is minimised. `vector`: (size,), x, its rows one after the other."""
        return self._at(vector).criterion.cost

    def own(self, vector: Array) -> float:
        """The criterion alone, see `CriterionValue.own`. `vector`: (size,), x, its rows one after the other."""
        return self._at(vector).criterion.own

    def gradient(self, vector: Array) -> Array:
        """Derivative of the cost, (size,). `vector`: (size,), x."""
        at = self._at(vector)
        by_motion = self._regressor.pull_back(at.motion, at.rows, at.criterion.gradient / self._scaling)
        return self._grid.pull_back(by_motion).ravel()

    def constraints(self, vector: Array) -> Array:
        """1 - smooth largest usage of everything limited, (C,): not negative where feasible. `vector`: (size,), x."""
        at = self._at(vector)
        kinematic = self._kinematics.smooth(at.x, self._kinematic_scale).values
        states = self._states.smooth_values(at.motion, at.base, self._state_scale)
        return 1.0 - np.concatenate([kinematic, states])

    def jacobian(self, vector: Array) -> Array:
        """Derivatives of `constraints`, (C, size). `vector`: (size,), x."""
        at = self._at(vector)
        kinematic = self._kinematics.smooth(at.x, self._kinematic_scale).jacobian
        gradients = self._states.smooth_gradients(at.motion, at.base, self._state_scale)
        states = [self._grid.pull_back(gradient)[None] for gradient in gradients]
        return -np.concatenate([kinematic, *states]).reshape(-1, len(vector))

    def calibrate(self, vector: Array) -> None:
        """Make the smooth largest usages exact at `vector`, (size,): from there on another problem's."""
        at = self._at(vector)
        smooth = self._kinematics.smooth(at.x, np.ones_like(self._kinematic_scale)).values
        self._kinematic_scale = self._kinematics.largest(at.x).ravel() / np.maximum(smooth, 1e-12)
        parts = self._states.usages(self._fine.motion(at.x)) if self._states.parts else []
        smooth = self._states.smooth_values(at.motion, at.base, np.ones_like(self._state_scale))
        largest = np.array([part.max() for part in parts])
        self._state_scale = np.where(smooth > 1e-6, largest / np.maximum(smooth, 1e-6), 1.0)

    def _at(self, vector: Array) -> _Evaluation:
        x = np.asarray(vector).reshape(self.shape)
        if self._last is not None and np.array_equal(self._last.x, x):
            return self._last
        self.evaluations += 1
        motion = self._grid.motion(x)
        base = self._regressor.base_regressor(motion)
        rows = self._regressor.rows(motion, base)
        information = self._regressor.information(rows) / self._scaling
        criterion = criterion_value(self.criterion, information, INFORMATION_WEIGHT)
        self._last = _Evaluation(x.copy(), motion, base, rows, criterion)
        return self._last
