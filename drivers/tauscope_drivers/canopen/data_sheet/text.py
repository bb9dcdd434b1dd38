"""The text of an EDS or DCF file (CiA 306) in the one spelling that the library's reader takes.

That reader stumbles over empty values and over what nobody needs (comments, dummies), is strict about upper case, and
leaves out what a DCF states of a compact array.
"""

import configparser
import re

_KEYWORDS = {
    word.lower(): word
    for word in (
        *("ParameterName", "ObjectType", "DataType", "AccessType", "PDOMapping", "DefaultValue", "ParameterValue"),
        *("CompactSubObj", "VendorNumber", "ProductNumber", "RevisionNumber", "NodeID"),
    )
}
_NUMBERS = (
    *("ObjectType", "DataType", "PDOMapping", "CompactSubObj"),
    *("VendorNumber", "ProductNumber", "RevisionNumber", "NodeID"),
)
_OBJECT = re.compile(r"([0-9a-f]{1,4})(?:sub([0-9a-f]{1,2})|(value|name))?", re.IGNORECASE | re.ASCII)
_DEVICE = {"deviceinfo": "DeviceInfo", "devicecomissioning": "DeviceComissioning"}  # CiA 306 spells it so
_OF_COMPACT = ("DataType", "AccessType", "PDOMapping", "DefaultValue")
_MOST_SUBINDICES = 254

Sections = dict[str, dict[str, str]]
"""Keywords and values of each section."""


class DataSheetError(ValueError):
    """A file is not usable; the message is one line with the place in the file and the next step, not its name."""


def read_sections(text: str) -> Sections:
    """Sections that describe the device and its objects; compact arrays are written out.

    Raises
    ------
    DataSheetError
        it is no such file; names the line or the section
    """
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
        sections[name] = {_KEYWORDS.get(key, key): value for key, value in parser.items(given) if value}
        _require_numbers(name, sections[name])
    _write_out_compact(sections)
    sections.setdefault("DeviceInfo", {})
    return sections


def library_text(sections: Sections) -> str:
    """The sections for the library's reader: parents before their subindices, and known keywords alone."""
    lines: list[str] = []
    for name in sorted(sections, key=lambda name: "sub" in name):
        known = ((key, value) for key, value in sections[name].items() if key in _KEYWORDS.values())
        lines += [f"[{name}]", *(f"{key}={value}" for key, value in known)]
    return "\n".join(lines)


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


def _require_numbers(section: str, entries: dict[str, str]) -> None:
    """Refuse numbers that are none, by their place: the library does not know it any more."""
    for key in _NUMBERS:
        if key in entries:
            _number(section, key, entries[key])


def _number(section: str, key: str, text: str) -> int:
    try:
        return int(text, 0)
    except ValueError as error:
        raise DataSheetError(f"{key} in [{section}] is {text[:40]!a}, which is no number; correct it") from error


def _write_out_compact(sections: Sections) -> None:
    """Subindices of compact arrays as sections of their own, each with its own name and value where it has one."""
    for name in [name for name in sections if _number(name, "CompactSubObj", sections[name].get("CompactSubObj", "0"))]:
        entries = sections[name]
        count = int(entries.pop("CompactSubObj"), 0)
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
