"""Modes of operation (0x6060) for each control mode, and the object that commands each."""

from collections.abc import Mapping

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.objects import DriveObject

TARGETS: Mapping[ControlMode, Mapping[int, DriveObject]] = {
    ControlMode.POSITION: {
        objects.CYCLIC_POSITION: objects.TARGET_POSITION,
        objects.INTERPOLATED_POSITION: objects.INTERPOLATION_DATA,
    },
    ControlMode.TORQUE: {objects.CYCLIC_TORQUE: objects.TARGET_TORQUE},
}
"""Modes of operation, the best first, and the target of each."""


def select_modes(supported: int) -> dict[ControlMode, int]:
    """Mode of operation for each control mode that a drive has.

    Parameters
    ----------
    supported : int
        0x6502, in which bit n - 1 stands for mode n
    """
    found = {
        mode: next((number for number in targets if supported >> (number - 1) & 1), None)
        for mode, targets in TARGETS.items()
    }
    return {mode: number for mode, number in found.items() if number is not None}
