"""Torque that a motion will need, as far as the prior model knows."""

import numpy as np

from tauscope.dynamics import BaseParameters
from tauscope.excitation.information import ExcitationRegressor, MotionGradient
from tauscope.robot import FrictionCoefficients, Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples
from tauscope.trajectory.servo_bounds import TorqueBounds

REST_SPEED = 1e-3  # part of the speed limit below which |v| is rounded off, for a gradient at rest
SMALL_TORQUE = 1e-2  # part of the torque limit below which |τ| is rounded off, for a gradient where it changes its sign


class TorquePrediction:
    """Upper bound of |τ|: rigid-body torque and the larger of stiction and Coulomb level, whichever way friction acts.

    `velocity`: (n,), speed limits [rad/s or m/s]; `bounds`: of torque, with what the servos' own damping takes of it.
    """

    def __init__(
        self, robot: Robot, base: BaseParameters, regressor: ExcitationRegressor, velocity: Array, bounds: TorqueBounds
    ) -> None:
        if robot.model.links is None:
            raise ValueError("the robot has no model: there is nothing to predict with")
        self._robot, self._base_parameters, self._velocity = robot, base, velocity
        parameters = np.concatenate([link.to_vector() for link in robot.model.links])
        friction = robot.model.friction or (FrictionCoefficients(),) * robot.joint_count
        self._regressor = regressor
        self._base = base.project(parameters)
        self._level = np.array([max(abs(f.stiction), abs(f.stiction + f.stribeck)) for f in friction])
        self._viscous = np.array([abs(f.viscous) for f in friction])
        self._rest = REST_SPEED * velocity
        self.bounds = bounds
        least = bounds.available.min(axis=0)
        self._small = np.where(np.isfinite(least), SMALL_TORQUE * least, 1.0)

    def seen_by(self, regressor: ExcitationRegressor) -> "TorquePrediction":
        """The same prediction from another regressor's base columns."""
        return TorquePrediction(self._robot, self._base_parameters, regressor, self._velocity, self.bounds)

    def torque(self, motion: MotionSamples, base: Array | None = None) -> Array:
        """Bound of |τ| at every sample, (N, n) [Nm or N]; `base`: (n, m, N), where the caller has it."""
        base = self._regressor.base_regressor(motion) if base is None else base
        return self._round_off(self._rigid(base), self._small) + self._friction(motion)

    def usage(self, motion: MotionSamples, base: Array | None = None) -> Array:
        """Used part of every bound, (N, bounds × n), zero without limit; `base`: (n, m, N)."""
        speed = self._round_off(motion.velocity, self._rest)
        return self.bounds.share(self.torque(motion, base), speed).reshape(len(speed), -1)

    def pull_back(self, motion: MotionSamples, base: Array, weight: Array) -> MotionGradient:
        """Derivatives by the motion of Σ weight · usage; `weight`: (N, bounds × n), `base`: (n, m, N)."""
        rigid = self._rigid(base)
        by_bound = weight.reshape(len(weight), *self.bounds.available.shape) / self.bounds.available
        by_torque = by_bound.sum(axis=1)
        by_speed = by_torque * self._viscous + (by_bound * self.bounds.damping).sum(axis=1)
        by_rigid = by_torque * rigid / self._round_off(rigid, self._small)
        columns = by_rigid.T[:, None, :] * self._base[None, :, None]
        gradient = self._regressor.pull_back_base(motion, columns)
        speed = motion.velocity / self._round_off(motion.velocity, self._rest)
        return MotionGradient(gradient.position, gradient.velocity + by_speed * speed, gradient.acceleration)

    def _rigid(self, base: Array) -> Array:
        first = self._regressor.first_columns
        return np.stack([self._base[at:] @ base[joint, at:] for joint, at in enumerate(first)], axis=1)

    def _friction(self, motion: MotionSamples) -> Array:
        return self._level + self._viscous * self._round_off(motion.velocity, self._rest)

    @staticmethod
    def _round_off(values: Array, small: Array) -> Array:
        """√(x² + ε²), never less than |x|."""
        return np.sqrt(values**2 + small**2)
