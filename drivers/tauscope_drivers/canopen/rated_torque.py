"""The rated torque of a motor (0x6076): CiA 402 has mNm, some makers have µNm."""

import math
from dataclasses import dataclass

_MILLI, _MICRO = 1e-3, 1e-6

_HALF_WAY = math.sqrt(_MILLI / _MICRO)
"""Two units are a factor of 1000 apart: a value nearer to one than to the other is within the root of it."""

_NM_PER_AMPERE = 0.15
"""Torque constant of an arm's motor at its shaft: 0.005 to 5 Nm/A, the geometric mean [Nm/A]."""

_LARGEST_NM = 100.0
"""No motor of an arm has more at its shaft, also without a gear [Nm]."""


@dataclass(frozen=True)
class RatedTorque:
    """A motor's rated torque.

    nm : float
        at the motor shaft [Nm]
    remark : str
        why another unit than the standard's is taken; empty where it is the standard's
    """

    nm: float
    remark: str = ""


def read_rated_torque(
    value: int, gear_ratio: float, torque_limit: float | None, rated_current_ma: int | None
) -> RatedTorque:
    """Rated torque in the unit that fits the joint's torque limit, else the rated current (0x6075).

    Raises ValueError where neither unit fits, or it reads 0.

    Parameters
    ----------
    value : int
        as the drive states it [mNm or µNm]
    torque_limit : float or None
        of the joint; None where the robot file states none [Nm or N]
    rated_current_ma : int or None
        None where the drive states none [mA]
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
