"""Whether the drive on the bus is the one that its EDS or DCF file describes."""

from typing import Protocol

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile
from tauscope_drivers.canopen.objects import DriveObject
from tauscope_drivers.errors import DriverError, DriverErrorKind


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
