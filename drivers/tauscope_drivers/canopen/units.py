"""A drive's counts and per mille, and the joint's radians and newton metres."""

import math
from dataclasses import dataclass

from tauscope_drivers.canopen.configuration import NodeConfiguration


@dataclass(frozen=True)
class DriveUnits:
    """What one unit of a drive means at the joint.

    radians_per_count : float
        2π ÷ (counts a motor turn × gear ratio), signed where the drive turns the other way round than the joint; metres
        a count on prismatic joints [rad or m]
    torque_per_permille : float
        joint torque for one part in thousand of the motor's rated torque (0x6076), signed likewise [Nm or N]
    """

    radians_per_count: float
    zero_count: int
    torque_per_permille: float

    def position(self, counts: int) -> float:
        """Joint position [rad or m]."""
        return (counts - self.zero_count) * self.radians_per_count

    def counts(self, position: float) -> int:
        """Nearest count of a joint position.

        Parameters
        ----------
        position : float
            finite [rad or m]
        """
        return round(position / self.radians_per_count) + self.zero_count

    def velocity(self, counts_per_second: int) -> float:
        """Joint velocity [rad/s or m/s]."""
        return counts_per_second * self.radians_per_count

    def torque(self, permille: int) -> float:
        """Joint torque [Nm or N]."""
        return permille * self.torque_per_permille

    def permille(self, torque: float) -> int:
        """Nearest per mille of a joint torque.

        Parameters
        ----------
        torque : float
            finite [Nm or N]
        """
        return round(torque / self.torque_per_permille)

    def torque_cap(self, torque: float) -> int:
        """Largest whole per mille within a torque limit (0x6072).

        Parameters
        ----------
        torque : float
            limit of the joint, infinite where there is none [Nm or N]
        """
        most = abs(torque / self.torque_per_permille)
        return 0xFFFF if most >= 0xFFFF else math.floor(most)


def drive_units(configuration: NodeConfiguration, rated_torque_nm: float) -> DriveUnits:
    """The units of a drive and its gear.

    Parameters
    ----------
    rated_torque_nm : float
        at the motor shaft [Nm]
    """
    turns = configuration.counts_per_turn * configuration.gear_ratio * configuration.direction
    permille = configuration.direction * rated_torque_nm * abs(configuration.gear_ratio) / 1000.0
    return DriveUnits(2.0 * math.pi / turns, configuration.zero_count, permille)
