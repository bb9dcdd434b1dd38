"""The process data of every drive: which objects are in it, under which identifiers, and where the drive keeps that."""

from dataclasses import dataclass

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.objects import DriveObject
from tauscope_drivers.canopen.pdo import PdoLayout

RECEIVED_ID = 0x200
SENT_IDS = (0x180, 0x280)

STATE_PDO = PdoLayout((objects.STATUSWORD, objects.TORQUE_ACTUAL, objects.POSITION_ACTUAL))
MOTION_PDO = PdoLayout((objects.VELOCITY_ACTUAL, objects.ERROR_CODE))
TARGET_PDOS = {
    ControlMode.POSITION: PdoLayout((objects.CONTROLWORD, objects.TARGET_POSITION)),
    ControlMode.TORQUE: PdoLayout((objects.CONTROLWORD, objects.TARGET_TORQUE)),
}


@dataclass(frozen=True)
class PdoParameters:
    """Where a drive keeps what one of its PDOs is."""

    identifier: DriveObject
    kind: DriveObject
    count: DriveObject
    entries: tuple[DriveObject, ...]


def received_parameters(layout: PdoLayout) -> PdoParameters:
    """Parameters of the PDO with the targets."""
    return _parameters(0x1400, 0x1600, layout)


def sent_parameters(number: int, layout: PdoLayout) -> PdoParameters:
    """Parameters of a PDO with measurements.

    Parameters
    ----------
    number : int
        from 0, as in `SENT_IDS`
    """
    return _parameters(0x1800 + number, 0x1A00 + number, layout)


def _parameters(communication: int, mapping: int, layout: PdoLayout) -> PdoParameters:
    """Communication and mapping parameter, CiA 301."""
    places = range(1, len(layout.objects) + 1)
    return PdoParameters(
        identifier=DriveObject("PDO COB-ID", communication, 1, 32),
        kind=DriveObject("PDO transmission type", communication, 2, 8),
        count=DriveObject("PDO number of entries", mapping, 0, 8),
        entries=tuple(DriveObject("PDO entry", mapping, subindex, 32) for subindex in places),
    )
