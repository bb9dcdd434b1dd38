"""What the servos move: anything that torque moves, such as a pendulum a joint."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tauscope.robot.robot import Array
from tauscope_sim.dynamixel_bus.servo import Demand

BANDWIDTH_HZ = 8.0  # of the pendulums' position loops [Hz]
INERTIA, DAMPING = 0.05, 0.05  # J [kg m²] and b [Nm s/rad] of every pendulum


class Pendulums:
    """A pendulum a joint: J q̈ = τ − b q̇ − m g l sin q, without coupling; enough to test a bus.

    Position loops are critically damped and without integral, so that they droop under a load as a servo's do:
    τ = J ω² (q_g − q) + 2 J ω (q̇_g − q̇).
    """

    def __init__(self, position: ArrayLike, *, weight: float = 0.5) -> None:
        """Place them at rest. `position`: (n,), where they stand [rad]; `weight`: m g l [Nm]."""
        self._position = np.array(position, dtype=np.float64)
        self._velocity = np.zeros_like(self._position)
        self.joint_count = self._position.size
        self._weight = weight

    @property
    def motion(self) -> tuple[Array, Array]:
        """Position and velocity."""
        return self._position.copy(), self._velocity.copy()

    def torque(self, demands: Sequence[Demand]) -> Array:
        """Torque of the position loops where a target is tracked, else the demand, (n,)."""
        omega = 2.0 * np.pi * BANDWIDTH_HZ
        torque = np.zeros(self.joint_count)
        for joint, demand in enumerate(demands):
            wanted = demand.torque
            if demand.tracks:
                error = demand.position - self._position[joint]
                error_rate = demand.speed - self._velocity[joint]
                wanted = INERTIA * omega * (omega * error + 2.0 * error_rate)
            torque[joint] = max(-demand.cap, min(demand.cap, wanted))
        return torque

    def advance(self, torque: Array, duration_s: float) -> None:
        """Move on under a constant torque, by the semi-implicit Euler method. `torque`: (n,) [Nm]."""
        load = DAMPING * self._velocity + self._weight * np.sin(self._position)
        self._velocity += duration_s * (torque - load) / INERTIA
        self._position += duration_s * self._velocity
