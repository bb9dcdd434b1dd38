"""Whether a drive is what the driver needs and what its EDS or DCF file states."""

from collections.abc import Iterator
from typing import Protocol

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.data_sheet.device_file import TYPE_NAMES, DataSheetError, DeviceFile
from tauscope_drivers.canopen.objects import DriveObject
from tauscope_drivers.canopen.process_data import (
    MOTION_PDO,
    STATE_PDO,
    TARGET_PDOS,
    PdoParameters,
    received_parameters,
    sent_parameters,
)
from tauscope_drivers.errors import DriverError, DriverErrorKind

_READ = (objects.DEVICE_TYPE, objects.SUPPORTED_MODES)
_WRITTEN = (
    *(objects.MODE_OF_OPERATION, objects.QUICK_STOP_OPTION, objects.ABORT_CONNECTION, objects.FAULT_REACTION_OPTION),
    *(objects.LARGEST_TORQUE, objects.LOWEST_POSITION, objects.HIGHEST_POSITION),
    *(objects.CONSUMER_HEARTBEAT, objects.PRODUCER_HEARTBEAT),
)
_WRITTEN_WHERE_THERE = (objects.INTERPOLATION_VALUE, objects.INTERPOLATION_EXPONENT)


def require_needed(file: DeviceFile, *, reads_rated_torque: bool) -> None:
    """Refuse a drive without an object that the driver needs of every drive, or with one of another kind.

    Raises
    ------
    DataSheetError
        names the object
    """
    for entry in (*_READ, *((objects.RATED_TORQUE,) if reads_rated_torque else ())):
        _require(file, entry)
    for entry in (*_WRITTEN, *(entry for entry in _WRITTEN_WHERE_THERE if _place(entry) in file.objects)):
        _require(file, entry, is_written=True)
    for entry in (*STATE_PDO.objects, *MOTION_PDO.objects):
        _require(file, entry, is_mapped=True)
    for entry in _pdo_places():
        _require(file, entry, is_written=True)
    require_target(file, ControlMode.POSITION)
    if _place(objects.TARGET_TORQUE) in file.objects:
        require_target(file, ControlMode.TORQUE)


def require_target(file: DeviceFile, mode: ControlMode) -> None:
    """Refuse a drive that takes no targets of a mode.

    Raises
    ------
    DataSheetError
        names the object
    """
    for entry in TARGET_PDOS[mode].objects:
        _require(file, entry, is_mapped=True, is_written=True)


def _pdo_places() -> Iterator[DriveObject]:
    """Where the drive keeps what its PDOs are; targets of both modes have the same."""

    def places(parameters: PdoParameters) -> Iterator[DriveObject]:
        yield from (parameters.identifier, parameters.kind, parameters.count, *parameters.entries)

    yield from places(received_parameters(TARGET_PDOS[ControlMode.POSITION]))
    for number, layout in enumerate((STATE_PDO, MOTION_PDO)):
        yield from places(sent_parameters(number, layout))


def _require(file: DeviceFile, entry: DriveObject, *, is_mapped: bool = False, is_written: bool = False) -> None:
    """Refuse an object that is not there, or not as the driver needs it."""
    described, flaw = file.objects.get(_place(entry)), None
    wanted = f"{'INTEGER' if entry.signed else 'UNSIGNED'}{entry.bits}"
    if described is None:
        flaw = "is missing"
    elif TYPE_NAMES.get(described.data_type) != wanted:
        flaw = f"is {described.type_name}, not {wanted}"
    elif is_mapped and not described.is_mappable:
        flaw = "cannot be mapped to a PDO (PDOMapping)"
    elif is_written and "w" not in described.access:
        flaw = f"cannot be written (AccessType {described.access[:20]!a})"
    if flaw is not None:
        raise DataSheetError(f"{entry} {flaw}, and the driver needs it; check that it is the file of this drive")


def _place(entry: DriveObject) -> tuple[int, int]:
    return entry.index, entry.subindex


class OptionalReader(Protocol):
    """What reads a drive's entries."""

    def read_optional(self, entry: DriveObject) -> int | None:
        """Value of an entry; None where the drive has none."""
        ...


def require_identity(file: DeviceFile, dictionary: OptionalReader, place: str) -> None:
    """Refuse a drive of another vendor, product or revision than its file states; what it does not tell passes.

    Raises
    ------
    DriverError
        ``refused``: names what differs
    """
    for entry, stated in (
        (objects.VENDOR, file.vendor),
        (objects.PRODUCT, file.product),
        (objects.REVISION, file.revision),
    ):
        if stated is None:
            continue
        told = dictionary.read_optional(entry)
        is_same = told in (None, stated) or (entry is objects.REVISION and _behaves_alike(told, stated))
        if not is_same:
            raise DriverError(
                DriverErrorKind.REFUSED,
                f"{place}: {entry} reads 0x{told:X}, and {file.name} states 0x{stated:X}; "
                "check drive.node_id, or give the file of this drive",
            )


def _behaves_alike(told: int | None, stated: int) -> bool:
    """Whether the major half of the revision number is the same: CiA 301 counts changes of behaviour there."""
    return told is not None and told >> 16 == stated >> 16 != 0
