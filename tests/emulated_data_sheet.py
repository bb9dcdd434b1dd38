"""EDS and DCF files of the emulated drives, written from their own object dictionary."""

from collections.abc import Mapping
from itertools import groupby
from pathlib import Path

from tauscope_sim.canopen_bus.drive import AxisScale, EmulatedDrive

VENDOR, PRODUCT, REVISION = 0x3A1, 0x402, 0x00020005
GAIN, OFFSET, LABEL, COMMAND = "2001", "2002", "2003", "2004"
"""A maker's own objects: UNSIGNED16, INTEGER16, VISIBLE_STRING, and one that is written only."""

Sections = dict[str, dict[str, str]]

_UNSIGNED, _SIGNED = {1: 5, 2: 6, 4: 7}, {1: 2, 2: 3, 4: 4}  # CiA 301, table 44
_STATED = ("6502", "16", "1A")
"""What a file states as delivered: modes, and the mappings of PDOs."""
_MAPPABLE = {"603F", "6040", "6041", "6060", "6064", "606C", "6071", "6077", "607A"}


def sections(drive: EmulatedDrive | None = None, **device: str) -> Sections:
    """Keywords of every section of a drive's EDS, which a test may change; `device` goes into DeviceInfo."""
    drive = drive or EmulatedDrive(1, AxisScale(1.0, 500, 1.0))
    found: Sections = {"FileInfo": {"FileName": "drive.eds"}, "DeviceInfo": {"VendorName": "nobody", **device}}
    entries = {place: entry for place, entry in drive.dictionary.entries.items() if entry.is_visible}
    for index, places in groupby(sorted(entries), key=lambda place: place[0]):
        subindices = [subindex for _, subindex in places]
        section = f"{index:04X}"
        if subindices == [0]:
            found[section] = _variable(section, entries[index, 0])
            continue
        found[section] = {"ParameterName": f"record {section}", "ObjectType": "0x9"}
        found[section + "sub0"] = _constant("Number of entries")
        for subindex in subindices:
            found[f"{section}sub{subindex:X}"] = _variable(f"{section} {subindex}", entries[index, subindex])
    found[GAIN] = _own("Gain", "0x0006", "rw")
    found[OFFSET] = _own("Offset", "0x0003", "rw")
    found[LABEL] = _own("Label", "0x0009", "rw")
    found[COMMAND] = _own("Tune now", "0x0005", "wo")
    return found


def text_of(content: Mapping[str, Mapping[str, str]]) -> str:
    """The file's text."""
    blocks = ("\n".join([f"[{name}]", *(f"{key}={value}" for key, value in content[name].items())]) for name in content)
    return "\n\n".join(blocks) + "\n"


def write_file(folder: Path, content: Mapping[str, Mapping[str, str]], name: str = "drive.eds") -> str:
    """Path of a new file."""
    path = folder / name
    path.write_text(text_of(content), encoding="utf-8")
    return str(path)


def _variable(name: str, entry) -> dict[str, str]:
    return {
        "ParameterName": f"object {name}",
        "ObjectType": "0x7",
        "DataType": f"0x{(_SIGNED if entry.signed else _UNSIGNED)[entry.bytes]:04X}",
        "AccessType": "rw" if entry.writable else "ro",
        "DefaultValue": str(entry.value) if name.startswith(_STATED) else "" if name == "1000" else "0",
        "PDOMapping": "1" if name in _MAPPABLE else "0",
    }


def _constant(name: str) -> dict[str, str]:
    return {"ParameterName": name, "ObjectType": "0x7", "DataType": "0x0005", "AccessType": "ro", "PDOMapping": "0"}


def _own(name: str, data_type: str, access: str) -> dict[str, str]:
    return {"ParameterName": name, "DataType": data_type, "AccessType": access, "PDOMapping": "0"}
