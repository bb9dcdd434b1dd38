"""An EDS or DCF file: which objects its maker says a drive has, who it is, and the values that a DCF gives it."""

import codecs
import configparser
import contextlib
import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from canopen.objectdictionary import ObjectDictionaryError, ODVariable, datatypes

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.objects import DriveObject

_NUMBERS = (
    *("ObjectType", "DataType", "PDOMapping", "CompactSubObj"),
    *("VendorNumber", "ProductNumber", "RevisionNumber", "NodeID"),
)
_TEXTUAL = ("ParameterName", "AccessType", "DefaultValue", "ParameterValue")
_KEYWORDS = {word.lower(): word for word in (*_NUMBERS, *_TEXTUAL)}
_OBJECT = re.compile(r"([0-9a-f]{1,4})(?:sub([0-9a-f]{1,2})|(value|name))?", re.IGNORECASE | re.ASCII)
_DEVICE = {
    "deviceinfo": "DeviceInfo",
    "devicecomissioning": "DeviceComissioning",  # CiA 306 spells it so
    "devicecommissioning": "DeviceComissioning",
}
_LONGEST_NUMBER = 64  # digits of 64 bits, in whatever base
_NODE_ID = re.compile(r"\+?\$NODEID\+?")
_OF_COMPACT = ("DataType", "AccessType", "PDOMapping", "DefaultValue")
_MOST_SUBINDICES = 254

Sections = dict[str, dict[str, str]]  # keywords and values of each section


class DataSheetError(ValueError):
    """A file is not usable; the message is one line with the place in the file and the next step, not its name."""


def read_sections(text: str) -> Sections:
    """Sections of the device and its objects, compact arrays written out. Raises DataSheetError: no such file."""
    # No section is everybody's default, and no indented line goes on with the one before.
    parser = configparser.RawConfigParser(inline_comment_prefixes=(";",), default_section="\0")
    try:
        parser.read_string("\n".join(line.strip() for line in text.splitlines()))
    except configparser.Error as error:
        raise DataSheetError(_place(error)) from error
    sections: Sections = {}
    for given in parser.sections():
        name = _section_name(given)
        if name is None:
            continue
        if name in sections:
            raise DataSheetError(f"[{name}] stands twice; remove one")
        # What stands for nothing counts as left out: many makers' tools write every keyword.
        entries = {_KEYWORDS.get(key, key): value for key, value in parser.items(given) if value}
        sections[name] = entries | {key: str(_number(name, key, entries[key])) for key in _NUMBERS if key in entries}
    _write_out_compact(sections)
    return sections


def _section_name(given: str) -> str | None:
    """Canonical name; None for a section that nobody needs."""
    match = _OBJECT.fullmatch(given)
    if match is None:
        return _DEVICE.get(given.lower())
    index = int(match[1], 16)
    name = f"{index:04X}" if len(match[1]) == 4 else f"{index:X}"
    if match[2]:
        return f"{name}sub{int(match[2], 16):X}"
    return name + (match[3] or "").capitalize()


def parse_number(text: str, node_id: int | None = None) -> int | None:
    """A whole number as files write it (CiA 306): decimal, hexadecimal also without 0x, octal, ``$NODEID``."""
    number = text.replace(" ", "").upper()
    if "$NODEID" in number:
        if node_id is None:
            return None
        offset = parse_number(_NODE_ID.sub("", number, count=1) or "0")
        return None if offset is None else offset + node_id
    for base in (0, 8, 10, 16) if len(number) <= _LONGEST_NUMBER else ():
        with contextlib.suppress(ValueError):
            return int(number, base)
    return None


def _number(section: str, key: str, text: str) -> int:
    number = parse_number(text)
    if number is None:
        raise DataSheetError(f"{key} in [{section}] is {text[:40]!a}, which is no number; correct it")
    return number


def _write_out_compact(sections: Sections) -> None:
    """Subindices of compact arrays as sections of their own, each with its own name and value where it has one."""
    for name in [name for name in sections if _number(name, "CompactSubObj", sections[name].get("CompactSubObj", "0"))]:
        entries = sections[name]
        count = int(entries.pop("CompactSubObj"))
        if not 1 <= count <= _MOST_SUBINDICES:
            raise DataSheetError(f"CompactSubObj in [{name}] is {count}; give 1 to {_MOST_SUBINDICES}")
        names, values = (sections.pop(f"{name}{kind}", {}) for kind in ("Name", "Value"))
        common = {key: entries[key] for key in _OF_COMPACT if key in entries}
        counted = {"ParameterName": "Number of entries", "DataType": "5", "AccessType": "ro"}
        sections.setdefault(f"{name}sub0", counted)
        for number in range(1, count + 1):
            own = {"ParameterName": names.get(str(number)) or f"{entries.get('ParameterName', name)} {number}"}
            if value := values.pop(str(number), None):
                own["ParameterValue"] = value
            sections.setdefault(f"{name}sub{number:X}", common | own)
        if left := [key for key in values if key.isdecimal()]:
            raise DataSheetError(f"[{name}Value] has a value {left[0]} of {count}; correct one of them")
    if stray := [name for name in sections if name.endswith("Value")]:
        raise DataSheetError(f"[{stray[0]}] belongs to no array with CompactSubObj; correct the section's name")


def _place(error: configparser.Error) -> str:
    """Where a file stops being one, without its content."""
    match error:
        case configparser.DuplicateSectionError():
            return f"line {error.lineno} begins a section that was there already; remove one"
        case configparser.DuplicateOptionError():
            return f"line {error.lineno} states {error.option[:40]!a} again; remove one"
        case configparser.MissingSectionHeaderError():
            return f"line {error.lineno} stands before any [section]; give an EDS or DCF file"
        case configparser.ParsingError() if error.errors:
            return f"line {error.errors[0][0]} is neither [section] nor keyword=value; correct it"
    return "is no EDS or DCF file; give one"


LARGEST_FILE = 8 * 1024 * 1024  # makers' files of drives have some hundred kilobytes [bytes]

_TYPE_NAMES = (
    *("BOOLEAN", "INTEGER8", "INTEGER16", "INTEGER32", "UNSIGNED8", "UNSIGNED16", "UNSIGNED32", "REAL32"),
    *("VISIBLE_STRING", "OCTET_STRING", "UNICODE_STRING", "DOMAIN", "REAL64", "INTEGER64", "UNSIGNED64"),
)
# data types of CiA 301 by their number
TYPE_NAMES: Mapping[int, str] = {getattr(datatypes, name): name for name in _TYPE_NAMES}
_TEXTS = ("VISIBLE_STRING", "UNICODE_STRING", "OCTET_STRING")
_VARIABLE = re.compile(r"([0-9A-F]{4})(?:sub([0-9A-F]+))?")  # canonical names of sections
_GROUPS = ("8", "9")  # object types of arrays and records, whose subindices are entries of their own
_LARGEST_TYPE = 0x1B  # a type beyond is the maker's own: [A0] and so on say what it is made of
_LONGEST_NAME = 60


@dataclass(frozen=True)
class DescribedObject:
    """One entry of the object dictionary as a file describes it."""

    name: str
    index: int
    subindex: int
    data_type: int
    access: str
    is_mappable: bool
    value_text: str | None = None
    value: bytes | None = None  # the same as it is transferred, little end first; None where it is not of its type
    default: int | None = None  # value as delivered; None where the file states none, or no whole number

    @property
    def type_name(self) -> str:
        """Name of its data type."""
        return TYPE_NAMES.get(self.data_type, f"data type 0x{self.data_type:02X}")


@dataclass(frozen=True)
class DeviceFile:
    """What a file says of a drive. `vendor`, `product`, `revision`: identity; None where it states none."""

    name: str
    objects: Mapping[tuple[int, int], DescribedObject]  # by index and subindex
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    node_id: int | None = None  # that a DCF is made for; None where it states none


def read_device_file(path: Path, node_id: int) -> DeviceFile:
    """Read a file. Raises DataSheetError where it cannot be read, or is no such file."""
    sections = read_sections(_content(path))
    entries = {(entry.index, entry.subindex): entry for entry in _describe_all(sections, node_id)}
    device = sections.get("DeviceInfo", {})

    def identity(entry: DriveObject, key: str) -> int | None:
        """By the device's section, or by the default of the object; zero is how makers leave it open."""
        described = entries.get((entry.index, entry.subindex))
        return int(device.get(key, "0")) or (described.default if described else None) or None

    made_for = sections.get("DeviceComissioning", {}).get("NodeID")
    return DeviceFile(
        name=_printable(path.name),
        objects=entries,
        vendor=identity(objects.VENDOR, "VendorNumber"),
        product=identity(objects.PRODUCT, "ProductNumber"),
        revision=identity(objects.REVISION, "RevisionNumber"),
        node_id=None if made_for is None else int(made_for),
    )


def _content(path: Path) -> str:
    """Text of a file of sensible size; what is not Unicode is one of Europe's 8-bit codes, for makers' units."""
    try:
        if not path.is_file():
            raise DataSheetError("there is no such file; give the path of the drive's EDS or DCF file")
        if path.stat().st_size > LARGEST_FILE:
            raise DataSheetError(f"is larger than {LARGEST_FILE // 1024**2} MiB; give an EDS or DCF file")
        data = path.read_bytes()
    except OSError as error:
        raise DataSheetError(f"cannot be read ({error.strerror or error}); check its permissions") from error
    try:
        return data.decode("utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _describe_all(sections: Sections, node_id: int) -> Iterator[DescribedObject]:
    """Every variable: objects that are one, and the subindices of the others."""
    for name, entries in sections.items():
        match = _VARIABLE.fullmatch(name)
        if match is None:
            continue
        index, subindex = match.groups()
        missing = [f"0x{index} was not found"] if index not in sections else []
        if not missing and (sections[index].get("ObjectType") in _GROUPS) != (subindex is not None):
            continue
        missing += [f"{key} is missing" for key in ("ParameterName", "DataType", "AccessType") if key not in entries]
        if missing:
            reason = f"[{name}]: {missing[0]}"
            raise DataSheetError(f"is no whole EDS or DCF file ({reason}); get it anew from the maker")
        data_type = int(entries["DataType"])
        if data_type > _LARGEST_TYPE:
            made_of = sections.get(f"{data_type:X}sub1", {}).get("DefaultValue", "")
            data_type = parse_number(made_of) or datatypes.DOMAIN
        is_whole = data_type in (datatypes.BOOLEAN, *datatypes.INTEGER_TYPES)
        text, default = entries.get("ParameterValue"), entries.get("DefaultValue")
        yield DescribedObject(
            name=_printable(entries["ParameterName"]),
            index=int(index, 16),
            subindex=int(subindex or "0", 16),
            data_type=data_type,
            access=entries["AccessType"].lower(),
            is_mappable=entries.get("PDOMapping", "0") != "0",
            value_text=None if text is None else _printable(text),
            value=None if text is None else _encode_value(data_type, text, node_id),
            default=parse_number(default, node_id) if default and is_whole else None,
        )


def _printable(name: str) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in name)[:_LONGEST_NAME]


def _encode_value(data_type: int, text: str, node_id: int) -> bytes | None:
    """A DCF's value as it goes over the bus; None where it is not of the object's type."""
    variable = ODVariable("", 0)
    variable.data_type = data_type
    try:
        if data_type in (datatypes.OCTET_STRING, datatypes.DOMAIN):
            return bytes.fromhex(text)
        if TYPE_NAMES.get(data_type) in _TEXTS:
            return bytes(variable.encode_raw(text))
        if data_type in datatypes.FLOAT_TYPES:
            return bytes(variable.encode_raw(float(text)))
        value = parse_number(text, node_id)
        if value is not None and data_type in datatypes.SIGNED_TYPES and not text.isdecimal():
            bits = len(variable)
            value -= (1 << bits) if 1 << bits - 1 <= value < 1 << bits else 0  # makers write -1 as 0xFFFF
        return None if value is None else bytes(variable.encode_raw(value))
    except (ValueError, TypeError, OverflowError, struct.error, ObjectDictionaryError):
        return None


_COMMUNICATION = range(0x1000, 0x2000)
_OWN = frozenset(
    entry.index
    for entry in (
        *(objects.MODE_OF_OPERATION, objects.QUICK_STOP_OPTION, objects.ABORT_CONNECTION),
        *(objects.FAULT_REACTION_OPTION, objects.LARGEST_TORQUE, objects.LOWEST_POSITION, objects.INTERPOLATION_VALUE),
    )
)
# controlword, targets, offsets to them, and outputs, among which is the brake: nobody asked to move
_COMMANDS = frozenset((0x6040, 0x6042, 0x6071, 0x607A, 0x60B0, 0x60B1, 0x60B2, 0x60C1, 0x60FE, 0x60FF))
_LINE = re.compile(r"node.?id|baud|bit.?rate", re.IGNORECASE)


@dataclass(frozen=True)
class Setting:
    """A value for a drive."""

    entry: DriveObject
    data: bytes
    text: str


@dataclass(frozen=True)
class Settings:
    """A DCF file's values; none of an EDS file. `torque_cap`: 0x6072, never exceeded [‰ of rated]."""

    written: tuple[Setting, ...]
    left_out: Mapping[str, tuple[DescribedObject, ...]]
    torque_cap: int | None = None


def settings_of(file: DeviceFile) -> Settings:
    """Values that a drive gets before it is commissioned. Raises DataSheetError where one is not of its type."""
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
