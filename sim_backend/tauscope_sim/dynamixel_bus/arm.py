"""What the servos move: anything that torque moves, such as a pendulum a joint."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import override

from tauscope.robot.robot import Array
from tauscope_sim.dynamixel_bus.servo import Demand

BANDWIDTH_HZ = 8.0  # of the pendulums' position loops [Hz]
INERTIA, DAMPING = 0.05, 0.05  # J [kg m²] and b [Nm s/rad] of every pendulum


class ServoArm(ABC):
    """An arm that servos move. `motion`: position and velocity of the motors, in joint units, each (n,)."""

    def __init__(self, motion: tuple[Array, Array]) -> None:
        self.motion = motion
        self.stands_on_stand = True

    def torque(self, demands: Sequence[Demand]) -> Array:
        """Torque of the position loops where a target is tracked, else the demand, (n,)."""
        cap, wanted, goal = np.array([(demand.cap, demand.torque, demand.position) for demand in demands]).T
        tracking = np.array([demand.tracks for demand in demands])
        if tracking.any():
            wanted = np.where(tracking, self._track(np.where(tracking, goal - self.motion[0], 0.0)), wanted)
        return np.clip(wanted, -cap, cap)

    @abstractmethod
    def advance(self, torque: Array, duration_s: float) -> None:
        """Move on under a constant torque. `torque`: (n,) [Nm or N]."""

    @abstractmethod
    def _track(self, error: Array) -> Array:
        """Torque of the position loops, (n,). `error`: goal less position [rad or m]."""


class Pendulums(ServoArm):
    """A pendulum a joint: J q̈ = τ − b q̇ − m g l sin q, without coupling; enough to test a bus.

    Position loops are critically damped and without integral, so that they droop under a load as a servo's do:
    τ = J ω² (q_g − q) − 2 J ω q̇.
    """

    def __init__(self, position: ArrayLike, *, weight: float = 0.5) -> None:
        """Place them at rest. `position`: (n,), where they stand [rad]; `weight`: m g l [Nm]."""
        place = np.array(position, dtype=np.float64)
        super().__init__((place, np.zeros_like(place)))
        self._weight = weight

    @override
    def advance(self, torque: Array, duration_s: float) -> None:
        # the semi-implicit Euler method
        position, velocity = self.motion
        load = DAMPING * velocity + self._weight * np.sin(position)
        velocity = velocity + duration_s * (torque - load) / INERTIA
        self.motion = position + duration_s * velocity, velocity

    @override
    def _track(self, error: Array) -> Array:
        omega = 2.0 * np.pi * BANDWIDTH_HZ
        return INERTIA * omega * (omega * error - 2.0 * self.motion[1])
