"""How an arm's recordings are written, where that is not as Tauscope writes them: columns, units, rate, separators."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

# Units that a column may be in, SI first; ``index`` counts samples, ``drive`` is any unit of a drive.
UNITS: Mapping[str, tuple[str, ...]] = {
    "t": ("s", "ms", "us", "ns", "min", "index"),
    "q": ("rad", "mrad", "deg", "rev", "m", "cm", "mm"),
    "qd": ("rad", "mrad", "deg", "rev", "rpm", "m", "cm", "mm"),
    "tau": ("Nm", "N", "mNm", "Ncm", "Nmm", "kNm", "kN", "lbft", "lbin", "ozin", "A", "mA", "drive"),
}

# Names of the layouts that are known.
PRESETS = ("rtde", "libfranka", "plotjuggler", "lerobot", "mujoco", "isaac", "odrive", "moteus")
DECIMALS = (".", ",")
# Delimiters, as signs and by name; a blank stands for any number of blanks and tabs.
DELIMITERS: Mapping[str, str] = {
    **{sign: sign for sign in (",", ";", "\t", " ", "|")},
    **{"comma": ",", "semicolon": ";", "tab": "\t", "\\t": "\t", "blank": " "},
}

Source = str | int | Sequence[str | int]
"""A column by name or by number from 1, one of them a joint, or a name with ``{0}``, ``{1}`` or ``{name}`` in it.

Two of them for t are seconds and nanoseconds.
"""

_COLUMN = re.compile(r"(t|q|qd|tau)([1-9][0-9]{0,3})?")
_TARGET = re.compile(r"t|period|(q|tau|i|qd|qdd|qref|taucmd|temp|qlink|volt|kp)([1-9][0-9]{0,3})?")
_GROUPS = "t, q, tau, i, qd, qdd, qref, taucmd, temp, qlink, volt, kp, period"


@dataclass(frozen=True)
class RecordingLayout:
    """Columns, units and separators of a recording."""

    # unit of ``t``, ``q``, ``qd``, ``tau``, or of one joint's column, ``q3``
    units: Mapping[str, str] = field(default_factory=dict)
    rate_hz: float | None = None  # samples a second where t counts samples [Hz]
    # where the columns of CONTRACT.md are, by column (``q3``) or for all joints
    columns: Mapping[str, Source] | str | None = None
    decimal: str | None = None  # None where the file shows it
    delimiter: str | None = None  # None where the file shows it
    topic: str | None = None  # of a log with several topics


def find_fault(units: Mapping[str, str], rate_hz: float | None) -> tuple[str, str] | None:
    """The column, or ``rate_hz``, whose unit cannot be used, and the reason; None where all can be."""
    for column, unit in units.items():
        match = _COLUMN.fullmatch(column)
        if match is None or (match[1] in ("t", "tau") and match[2]):
            return column, f"{column!r} has no unit to choose; name t, q, qd or tau, or one joint's column, as in q3"
        if unit not in UNITS[match[1]]:
            return column, f"{unit!r} is no unit of {column}; use {', '.join(UNITS[match[1]])}"
    if units.get("t") == "index" and rate_hz is None:
        return "t", "t counts samples: state their rate, too"
    if rate_hz is not None and units.get("t") != "index":
        return "rate_hz", "a rate needs t=index: any other unit of t states the time itself"
    return None


def find_column_fault(columns: Mapping[str, Source] | str | None) -> str | None:
    """The reason why columns cannot be used; None where they can be."""
    if isinstance(columns, str):
        return (
            None if columns in PRESETS else f"{columns!r} is no preset; use {', '.join(PRESETS)}, or name the columns"
        )
    for target, source in (columns or {}).items():
        match = _TARGET.fullmatch(target)
        if match is None:
            return f"{target!r} is no column of a recording; use {_GROUPS}, or one joint's, as in q3"
        is_split = target == "t" and isinstance(source, Sequence) and len(source) == 2
        if (target in ("t", "period") or match[2]) and not isinstance(source, str | int) and not is_split:
            return f"{target} is one column; give one name, or its number from 1"
        if isinstance(source, int) and not (target in ("t", "period") or match[2]):
            return f"{target} has one column a joint; list them, as in [2, 3, 4]"
    return None


def find_separator_fault(decimal: str | None, delimiter: str | None) -> tuple[str, str] | None:
    """The field, and the reason why it cannot separate; None where both can."""
    if decimal is not None and decimal not in DECIMALS:
        return "decimal", f"{decimal!r} is no decimal sign; use '.' or ','"
    if delimiter is not None and delimiter not in DELIMITERS:
        return "delimiter", f"{delimiter!r} separates no fields; use comma, semicolon, tab, blank or |"
    if decimal == "," and delimiter is not None and DELIMITERS[delimiter] == ",":
        return "delimiter", "a comma cannot be decimal sign and delimiter at once"
    return None
