"""What the simulated drives take from their host, and what they refuse."""

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers import DriveLimits, DriverError, Setpoint

Array = NDArray[np.float64]

ENABLE_MARGIN = 0.05
"""How far outside its range a joint may stand when it is enabled: as far as a stop can carry it [rad or m]."""


def checked_limits(limits: DriveLimits, position: Array) -> DriveLimits:
    """The limits as the drives keep them, in arrays of their own.

    Raises DriverError ``refused``: wrong shapes, not-a-number, an empty range, no room to move, or an arm outside its
    range.
    `position`: (n,), where the arm stands [rad or m].
    """
    count = len(position)
    arrays: dict[str, Array] = {}
    for name in ("position_low", "position_high", "velocity", "torque"):
        array = np.array(getattr(limits, name), dtype=np.float64)
        if array.shape != (count,) or np.isnan(array).any():
            raise DriverError.refusal(
                f"limits.{name} {array.tolist()} is not one number for each of {count} joints; state them all"
            )
        arrays[name] = array
    for name in ("velocity", "torque"):
        _refuse_first(arrays[name] <= 0.0, f"limits.{name} is not above zero; give a positive limit")
    low, high = arrays["position_low"], arrays["position_high"]
    _refuse_first(low >= high, "limits.position_low is not below limits.position_high; correct the range")
    outside = (position < low - ENABLE_MARGIN) | (position > high + ENABLE_MARGIN)
    _refuse_first(outside, "stands outside its position limits; move it into its range by hand, or widen the limits")
    return DriveLimits(**arrays)


def checked_setpoint(setpoint: Setpoint, joint_count: int) -> Setpoint:
    """The setpoint in arrays of its own.

    Raises DriverError ``refused``: wrong shapes, or a number that is not finite.
    """
    arrays = []
    for name in ("position", "torque"):
        array = np.array(getattr(setpoint, name), dtype=np.float64)
        if array.shape != (joint_count,):
            raise DriverError.refusal(
                f"setpoint.{name} has shape {array.shape}; give one number for each of {joint_count} joints"
            )
        finite = np.isfinite(array)
        if not finite.all():
            joint = int(np.argmin(finite)) + 1
            raise DriverError.refusal(f"joint {joint}: setpoint.{name} is {array[joint - 1]}; nothing was sent")
        arrays.append(array)
    return Setpoint(*arrays)


def _refuse_first(faulty: NDArray[np.bool_], message: str) -> None:
    if faulty.any():
        raise DriverError.refusal(f"joint {int(np.argmax(faulty)) + 1}: {message}")
