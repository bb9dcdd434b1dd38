"""How an arm's recordings are written, where that is not in SI units: the units of their columns and their rate."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

UNITS: Mapping[str, tuple[str, ...]] = {
    "t": ("s", "ms", "us", "ns", "index"),
    "q": ("rad", "deg", "m", "mm"),
    "qd": ("rad", "deg", "rpm", "m", "mm"),
    "tau": ("Nm", "N", "A", "mA", "drive"),
}
"""Units that a column may be in, SI first; ``index`` counts samples, ``drive`` is any unit of a drive."""

_COLUMN = re.compile(r"(t|q|qd|tau)([1-9][0-9]{0,3})?")


@dataclass(frozen=True)
class RecordingLayout:
    """Units of a recording's columns.

    units : mapping of str to str
        unit of ``t``, ``q``, ``qd``, ``tau``, or of one joint's column, ``q3``
    rate_hz : float or None
        samples a second where t counts samples [Hz]
    """

    units: Mapping[str, str] = field(default_factory=dict)
    rate_hz: float | None = None


def find_fault(units: Mapping[str, str], rate_hz: float | None) -> tuple[str, str] | None:
    """The column, or ``rate_hz``, whose unit cannot be used, and the reason; None where all can be.

    Parameters
    ----------
    rate_hz : float or None
        samples a second [Hz]
    """
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
