"""The simulated arm's physics as what the servos move."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope_sim.device.servo import InertiaSchedule
from tauscope_sim.dynamixel_bus.servo import Demand
from tauscope_sim.scenario import Scenario

BANDWIDTH = 40.0  # ω of the position loops [rad/s]

_TICKS_PER_INERTIA = 4


class PlantArm:
    """The arm of a robot file with what a scenario conceals, and position loops that were tuned to it.

    Goals come in steps, so the loops are soft, damp the joint's own speed, and have no integral, as servos are
    delivered: τ_j = H_jj (ω² (q_g − q)_j − 2 ω q̇_j) + g(q)_j, each joint for itself.
    """

    def __init__(self, robot: Robot, scenario: Scenario, position: ArrayLike) -> None:
        """Place the arm at rest. `position`: (n,), where it stands [rad or m]."""
        self._plant = scenario.plant(robot)
        self.joint_count = robot.joint_count
        self._plant.place(position)
        self._inertia = InertiaSchedule(robot, scenario.effects)
        self._age = 0
        self._look()

    @property
    def motion(self) -> tuple[Array, Array]:
        """Position and velocity of the motors, in joint units."""
        return self._position, self._velocity

    def torque(self, demands: Sequence[Demand]) -> Array:
        """Torque of the position loops where a target is tracked, else the demand, (n,)."""
        cap = np.array([demand.cap for demand in demands])
        wanted = np.array([demand.torque for demand in demands])
        tracking = np.array([demand.tracks for demand in demands])
        if tracking.any():
            goal = np.array([demand.position for demand in demands])
            wanted = np.where(tracking, self._track(np.where(tracking, goal - self._position, 0.0)), wanted)
        return np.clip(wanted, -cap, cap)

    def _track(self, error: Array) -> Array:
        if self._age == 0:
            matrix, _, load = self._inertia.at(self._position)
            self._own_inertia, self._load = matrix.diagonal().copy(), load.copy()
        self._age = (self._age + 1) % _TICKS_PER_INERTIA
        return self._own_inertia * (BANDWIDTH**2 * error - 2.0 * BANDWIDTH * self._velocity) + self._load

    def advance(self, torque: Array, duration_s: float) -> None:
        """Move on under a constant torque. `torque`: (n,) [Nm or N]."""
        self._plant.advance(torque, duration_s)
        self._look()

    def _look(self) -> None:
        state = self._plant.state
        self._position, self._velocity = state.motor_position, state.motor_velocity
