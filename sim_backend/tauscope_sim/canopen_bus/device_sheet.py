"""A maker's EDS or DCF file as the object dictionary of an emulated drive."""

from tauscope_drivers.canopen.data_sheet.device_file import DescribedObject, DeviceFile
from tauscope_sim.canopen_bus.object_dictionary import ObjectDictionary

_SIZES = {
    **{name: (size, False) for name, size in (("BOOLEAN", 1), ("UNSIGNED8", 1), ("UNSIGNED16", 2), ("UNSIGNED32", 4))},
    **{name: (size, True) for name, size in (("INTEGER8", 1), ("INTEGER16", 2), ("INTEGER32", 4))},
}
"""Bytes of a data type, and whether it is signed; longer ones are left out."""

_PROCESS_DATA = range(0x1400, 0x1C00)
_IDENTITY = 0x1018
_STATED = (0x6076, 0x6502)
"""Objects whose value is the maker's; what the drive measures or is told is the emulator's own."""


def apply_sheet(dictionary: ObjectDictionary, file: DeviceFile) -> None:
    """Hide the entries that a file does not have, add those that it has, and let its access rights hold."""
    for place, entry in dictionary.entries.items():
        entry.is_visible = place in file.objects
    for (index, subindex), described in file.objects.items():
        size, signed = _SIZES.get(described.type_name, (0, False))
        if not size:
            continue
        entry = dictionary.entries.get((index, subindex))
        is_own = entry is not None
        if entry is None:
            entry = dictionary.add(index, subindex, size)
        entry.bytes, entry.signed, entry.writable = size, signed, "w" in described.access
        value = _value(described)
        if value is not None and (not is_own or index in _PROCESS_DATA or (index in _STATED and value)):
            dictionary.put(index, value, subindex)
    for subindex, number in enumerate((file.vendor, file.product, file.revision), 1):
        if dictionary.has(_IDENTITY, subindex) and number is not None:
            dictionary.put(_IDENTITY, number, subindex)


def _value(described: DescribedObject) -> int | None:
    """Value of a DCF, else as delivered."""
    if described.value is None:
        return described.default
    return int.from_bytes(described.value, "little", signed=described.type_name.startswith("INTEGER"))
