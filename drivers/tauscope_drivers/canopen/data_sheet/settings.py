"""Which values of a DCF file a drive is given, and which not: what the driver sets itself, and commands."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.data_sheet.device_file import DataSheetError, DescribedObject, DeviceFile
from tauscope_drivers.canopen.objects import DriveObject

_COMMUNICATION = range(0x1000, 0x2000)
_OWN = frozenset(
    entry.index
    for entry in (
        *(objects.MODE_OF_OPERATION, objects.QUICK_STOP_OPTION, objects.ABORT_CONNECTION),
        *(objects.FAULT_REACTION_OPTION, objects.LARGEST_TORQUE, objects.LOWEST_POSITION, objects.INTERPOLATION_VALUE),
    )
)
_COMMANDS = frozenset((0x6040, 0x6042, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FE, 0x60FF))
"""Controlword, targets, offsets to them, and outputs, among which is the brake: nobody asked to move."""

_LINE = re.compile(r"node.?id|baud|bit.?rate", re.IGNORECASE)
_TEXTS = ("VISIBLE_STRING", "UNICODE_STRING", "OCTET_STRING")


@dataclass(frozen=True)
class Setting:
    """A value for a drive."""

    entry: DriveObject
    data: bytes
    text: str


@dataclass(frozen=True)
class Settings:
    """The values of a DCF file; none of an EDS file.

    `torque_cap`: largest torque (0x6072), which the driver sets itself and never above this [‰ of the rated torque].
    """

    written: tuple[Setting, ...]
    left_out: Mapping[str, tuple[DescribedObject, ...]]
    torque_cap: int | None = None


def settings_of(file: DeviceFile) -> Settings:
    """Values that a drive is given before it is commissioned.

    Raises DataSheetError where a value is not of its object's type; names both.
    """
    written: list[Setting] = []
    left_out: dict[str, tuple[DescribedObject, ...]] = {}
    for _, described in sorted(file.objects.items()):
        if described.value_text is None:
            continue
        reason = _reason_against(described)
        if reason is None:
            written.append(_setting(described, described.value_text))
        else:
            left_out[reason] = (*left_out.get(reason, ()), described)
    return Settings(tuple(written), left_out, _torque_cap(file))


def _torque_cap(file: DeviceFile) -> int | None:
    described = file.objects.get((objects.LARGEST_TORQUE.index, objects.LARGEST_TORQUE.subindex))
    if described is None or described.value_text is None:
        return None
    return int.from_bytes(_setting(described, described.value_text).data, "little")


def _reason_against(described: DescribedObject) -> str | None:
    if "w" not in described.access:
        return "read-only"
    if described.access == "wo":
        return "write-only, cannot be read back"
    if described.index in _COMMUNICATION:
        return "communication, the driver's own"
    if described.index in _OWN:
        return "set by the driver"
    if described.index in _COMMANDS:
        return "a command, no setting"
    if _LINE.search(described.name):
        return "node ID or bit rate"
    return None


def _setting(described: DescribedObject, text: str) -> Setting:
    is_text = described.type_name in _TEXTS
    size = 0 if is_text or described.value is None else 8 * len(described.value)
    entry = DriveObject(described.name, described.index, described.subindex, size)
    if described.value is None:
        raise DataSheetError(
            f"ParameterValue {text[:40]!a} of {entry} is no {described.type_name} that can be written; correct it"
        )
    return Setting(entry, described.value, text[:40])
