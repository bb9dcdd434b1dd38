"""Limits that servos do not keep by themselves while they are given current: position and speed, watched each cycle."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.backend import DriveLimits
from drivers.dynamixel.servo import JointServo
from drivers.errors import Fault

Array = NDArray[np.float64]

CATCH_S = 0.05
"""Time that catching a joint takes, change of mode and braking included: it is caught where it would be by then."""

SPEED_MARGIN = 1.1
"""Measured speed may be this many times the limit."""

PERSISTENCE = 2
"""Cycles in a row after which a speed counts: one noisy reading is no runaway."""


class RunawayWatch:
    """Looks at every reading of an arm that is given current."""

    def __init__(self, servos: Sequence[JointServo], limits: DriveLimits) -> None:
        """Begin with a sound arm.

        Parameters
        ----------
        servos : sequence of JointServo
            in the order of the joints
        limits : DriveLimits
            of the joints
        """
        self._servos, self._limits = tuple(servos), limits
        self._fast = np.zeros(len(self._servos), dtype=np.int64)

    def look(self, position: Array, velocity: Array) -> Fault | None:
        """The first joint that leaves its limits; NaN leaves none.

        Parameters
        ----------
        position : (n,) float64
            [rad or m]
        velocity : (n,) float64
            [rad/s or m/s]
        """
        limits = self._limits
        with np.errstate(invalid="ignore"):
            ahead = position + CATCH_S * velocity
            low = (ahead < limits.position_low) & (velocity <= 0.0)
            high = (ahead > limits.position_high) & (velocity >= 0.0)
            fast = np.abs(velocity) > SPEED_MARGIN * limits.velocity
        self._fast = np.where(fast, self._fast + 1, 0)
        for joint, servo in enumerate(self._servos):
            if low[joint] or high[joint]:
                end = limits.position_low[joint] if low[joint] else limits.position_high[joint]
                detail = f"at {position[joint]:.4g} and moving towards its limit {end:.4g}"
                return Fault("position-limit", servo.number, detail, _REMEDY)
            if self._fast[joint] >= PERSISTENCE:
                detail = f"moves at {velocity[joint]:.4g}, its limit is {limits.velocity[joint]:.4g}"
                return Fault("over-speed", servo.number, detail, _REMEDY)
        return None


_REMEDY = "the arm was caught and holds; correct the commanded torque, then acknowledge"
