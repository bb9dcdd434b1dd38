"""The row of units that some tools write below the names of the columns."""

import re
from collections.abc import Mapping, Sequence

_KNOWN: Mapping[str, Mapping[str, str]] = {
    "t": {"s": "s", "sec": "s", "seconds": "s", "ms": "ms", "us": "us", "µs": "us", "ns": "ns"},
    "q": {"rad": "rad", "deg": "deg", "°": "deg", "degrees": "deg", "m": "m", "mm": "mm"},
    "qd": {"rad/s": "rad", "deg/s": "deg", "°/s": "deg", "rpm": "rpm", "1/min": "rpm", "m/s": "m", "mm/s": "mm"},
    "qdd": {"rad/s^2": "rad", "rad/s2": "rad", "rad/s²": "rad", "m/s^2": "m", "m/s2": "m", "m/s²": "m"},
    "tau": {"Nm": "Nm", "N*m": "Nm", "N·m": "Nm", "N m": "Nm", "N": "N", "A": "A", "mA": "mA"},
}
_LIKE: Mapping[str, str] = {"i": "tau", "qref": "q", "qlink": "q", "taucmd": "tau"}
_FREE = ("temp", "period")
"""Groups whose units are not looked at."""


def read_units_row(names: Sequence[str], cells: Sequence[str]) -> dict[str, str] | None:
    """Units as a robot file states them, None where a cell holds no unit of its column.

    Parameters
    ----------
    names : sequence of str
        columns of CONTRACT.md
    cells : sequence of str
        cells of the row, one for each of them
    """
    units: dict[str, str] = {}
    for name, cell in zip(names, cells, strict=True):
        group = name.rstrip("0123456789")
        if group in _FREE:
            continue
        root = _LIKE.get(group, group)
        unit = _KNOWN[root].get(re.sub(r"^[\[({]\s*|\s*[\])}]$", "", cell.strip(' "')))
        if unit is None:
            return None
        key = root if root in ("t", "tau") else name
        if group not in ("t", "q", "qd", "tau", "i"):
            continue  # they follow
        if units.setdefault(key, unit) != unit:
            return None  # torques in two units
    return units
