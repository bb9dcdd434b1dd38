"""The units of a drive and SI: increments, the rated torque and what its thousandths are."""

import math
from dataclasses import dataclass

from tauscope_drivers.canopen.configuration import NodeConfiguration

_MILLI, _MICRO = 1e-3, 1e-6

# two units are a factor of 1000 apart: a value nearer to one than to the other is within the root of it
_HALF_WAY = math.sqrt(_MILLI / _MICRO)
_NM_PER_AMPERE = 0.15  # torque constant of an arm's motor at its shaft: 0.005 to 5 Nm/A, the geometric mean [Nm/A]
_LARGEST_NM = 100.0  # no motor of an arm has more at its shaft, also without a gear [Nm]


@dataclass(frozen=True)
class RatedTorque:
    """A motor's rated torque."""

    nm: float  # at the motor shaft [Nm]
    remark: str = ""  # why another unit than the standard's is taken; empty where it is the standard's


def read_rated_torque(
    value: int, gear_ratio: float, torque_limit: float | None, rated_current_ma: int | None
) -> RatedTorque:
    """Rated torque in the unit that fits the joint's torque limit, else by the rated current (0x6075).

    Raises ValueError where none fits. `value`: [mNm or µNm]; `torque_limit`: of the joint [Nm or N]; None where not
    stated.
    """
    milli, micro = value * _MILLI, value * _MICRO
    if value <= 0:
        raise ValueError("reads 0")
    expected, evidence = _expect(gear_ratio, torque_limit, rated_current_ma)
    least, most = expected / _HALF_WAY, min(expected * _HALF_WAY, _LARGEST_NM)
    if milli <= most and (milli >= least or math.isinf(expected)):
        return RatedTorque(milli)
    if milli <= most:
        return RatedTorque(milli, f"is taken in mNm, {milli:g} Nm, which is far below {evidence}; check both")
    if micro <= most:
        return RatedTorque(micro, f"is taken in µNm, {micro:g} Nm, for {milli:g} Nm in mNm does not fit {evidence}")
    raise ValueError(f"is {milli:g} Nm in mNm and {micro:g} Nm in µNm, and neither fits {evidence}")


def _expect(gear_ratio: float, torque_limit: float | None, rated_current_ma: int | None) -> tuple[float, str]:
    """Torque that a motor may have at its shaft, infinite where nothing tells [Nm], and by which evidence."""
    if torque_limit is not None and math.isfinite(torque_limit):
        return torque_limit / abs(gear_ratio), f"the joint's torque limit of {torque_limit:g}"
    if rated_current_ma:
        return _NM_PER_AMPERE * rated_current_ma * 1e-3, f"its rated current of {rated_current_ma} mA"
    return math.inf, "a motor of an arm"


@dataclass(frozen=True)
class DriveUnits:
    """What one unit of a drive means at the joint, signed where it turns the other way round.

    `radians_per_count`: 2π ÷ (counts a motor turn × gear ratio), metres on prismatic joints; `torque_per_permille`:
    joint torque for 1 ‰ of the motor's rated torque (0x6076) [Nm or N].
    """

    radians_per_count: float
    zero_count: int
    torque_per_permille: float

    def position(self, counts: int) -> float:
        """Joint position [rad or m]."""
        return (counts - self.zero_count) * self.radians_per_count

    def counts(self, position: float) -> int:
        """Nearest count of a joint position. `position`: finite [rad or m]."""
        return round(position / self.radians_per_count) + self.zero_count

    def velocity(self, counts_per_second: int) -> float:
        """Joint velocity [rad/s or m/s]."""
        return counts_per_second * self.radians_per_count

    def torque(self, permille: int) -> float:
        """Joint torque [Nm or N]."""
        return permille * self.torque_per_permille

    def permille(self, torque: float) -> int:
        """Nearest per mille of a joint torque. `torque`: finite [Nm or N]."""
        return round(torque / self.torque_per_permille)

    def torque_cap(self, torque: float) -> int:
        """Largest whole per mille within a torque limit (0x6072). `torque`: infinite where there is none [Nm or N]."""
        most = abs(torque / self.torque_per_permille)
        return 0xFFFF if most >= 0xFFFF else math.floor(most)


def drive_units(configuration: NodeConfiguration, rated_torque_nm: float) -> DriveUnits:
    """The units of a drive and its gear. `rated_torque_nm`: at the motor shaft [Nm]."""
    turns = configuration.counts_per_turn * configuration.gear_ratio * configuration.direction
    permille = configuration.direction * rated_torque_nm * abs(configuration.gear_ratio) / 1000.0
    return DriveUnits(2.0 * math.pi / turns, configuration.zero_count, permille)
