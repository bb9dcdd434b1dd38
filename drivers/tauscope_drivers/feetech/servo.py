"""A servo at its joint, and what its numbers mean there."""

import math
from dataclasses import dataclass

from tauscope_drivers.feetech import registers
from tauscope_drivers.feetech.configuration import ServoConfiguration

_ROUNDING = 1e-9


@dataclass(frozen=True)
class JointServo:
    """A servo that a robot file speaks of."""

    number: int  # of the joint, from 1
    configuration: ServoConfiguration
    counts_per_speed_unit: int = 1  # one unit of Present Speed and Goal Speed [counts/s]

    @property
    def servo(self) -> int:
        """ID."""
        return self.configuration.servo

    @property
    def label(self) -> str:
        """Name in messages."""
        return f"joint {self.configuration.joint} (servo {self.servo})"

    @property
    def _counts_per_unit(self) -> float:
        """Counts for one radian (metre) of the joint, signed."""
        return self.configuration.direction * self.configuration.reduction * registers.COUNTS_PER_RADIAN

    def position(self, counts: int) -> float:
        """Joint position [rad or m]."""
        return (counts - self.configuration.zero_count) / self._counts_per_unit

    def counts(self, position: float) -> int:
        """Nearest count of a joint position. `position`: finite [rad or m]."""
        return round(position * self._counts_per_unit) + self.configuration.zero_count

    def counts_within(self, low: float, high: float) -> tuple[int, int]:
        """Lowest and highest count of one turn between two positions, infinite where there is no limit [rad or m]."""
        ends = sorted((low * self._counts_per_unit, high * self._counts_per_unit))
        zero = self.configuration.zero_count
        lowest = 0 if ends[0] == -math.inf else max(0, math.ceil(ends[0] - _ROUNDING) + zero)
        highest = registers.COUNTS_PER_TURN - 1
        return lowest, highest if ends[1] == math.inf else min(highest, math.floor(ends[1] + _ROUNDING) + zero)

    def velocity(self, units: int) -> float:
        """Joint velocity [rad/s or m/s]."""
        return units * self.counts_per_speed_unit / self._counts_per_unit

    def goal_speed(self, velocity: float) -> int:
        """Goal Speed for a largest speed, which may be infinite [rad/s or m/s]; 1 at least: 0 may mean no limit."""
        most = velocity * abs(self._counts_per_unit) / self.counts_per_speed_unit
        return int(min(registers.LARGEST_SPEED, max(1.0, most)))

    def load(self, units: int) -> float:
        """Load, positive where the motor pushes the joint forward [‰ of full duty]."""
        return float(units * self.configuration.direction)

    def torque_per_permille(self, voltage: int) -> float:
        """Largest joint torque of 1 ‰ of duty, positive [Nm or N]. `voltage`: Present Voltage [0.1 V]."""
        stated = self.configuration.torque_per_permille
        if stated is not None:
            return abs(stated)
        return registers.TORQUE_PER_VOLT * voltage * registers.VOLT / registers.PERMILLE * self.configuration.reduction

    def torque_limit(self, torque: float, voltage: int) -> int:
        """Torque Limit for a largest torque, which may be infinite [Nm or N]. `voltage`: Present Voltage [0.1 V]."""
        unit = self.torque_per_permille(voltage)
        if torque == math.inf or unit == 0.0:
            return registers.PERMILLE
        return int(min(registers.PERMILLE, torque / unit + _ROUNDING))
