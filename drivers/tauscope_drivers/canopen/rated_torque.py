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

    Parameters
    ----------
    value : int
        as the drive states it [mNm or µNm]
    torque_limit : float or None
        of the joint; None where the robot file states none [Nm or N]
    rated_current_ma : int or None
        None where the drive states none [mA]

    Raises
    ------
    ValueError
        neither unit fits
    """
    milli, micro = value * _MILLI, value * _MICRO
    if value <= 0:
        raise ValueError("reads 0")
    if torque_limit is not None and math.isfinite(torque_limit):
        expected, evidence = torque_limit / abs(gear_ratio), f"the joint's torque limit of {torque_limit:g}"
    elif rated_current_ma:
        expected, evidence = _NM_PER_AMPERE * rated_current_ma * 1e-3, f"its rated current of {rated_current_ma} mA"
    elif milli <= _LARGEST_NM:
        return RatedTorque(milli)
    else:
        return RatedTorque(micro, f"is taken in µNm, {micro:g} Nm: no motor of an arm has {milli:g} Nm at its shaft")
    if milli / expected < 1.0 / _HALF_WAY or micro / expected > _HALF_WAY:
        raise ValueError(f"is {milli:g} Nm in mNm and {micro:g} Nm in µNm, and neither fits {evidence}")
    if milli / expected > _HALF_WAY:
        return RatedTorque(micro, f"is taken in µNm, {micro:g} Nm: in mNm it does not fit {evidence}")
    return RatedTorque(milli)
