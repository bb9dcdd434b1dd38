"""Units as people write them: in the name of a column, and in a row below the names."""

import re
from collections.abc import Mapping

from tauscope.robot.recording_layout import UNITS

# Other spellings than the unit's own, without blanks and signs.
_SPELLINGS: Mapping[str, str] = {
    "s": "sec secs second seconds",
    "ms": "msec millisecond milliseconds",
    "us": "µs μs usec microsecond microseconds",
    "ns": "nsec nanosecond nanoseconds",
    "min": "minute minutes",
    "rad": "radian radians",
    "deg": "degs degree degrees ° º",
    "rev": "revs revolution revolutions turn turns",
    "lbft": "lbfft ftlb ftlbf",
    "lbin": "lbfin inlb inlbf",
    "ozin": "ozfin inoz",
    "A": "amp amps ampere",
    "drive": "% percent pct ‰ permille promille 01%",
}
_PER_MINUTE = ("rpm", "1/min", "min1", "u/min")
_LIKE: Mapping[str, str] = {"i": "tau", "qref": "q", "qlink": "q", "taucmd": "tau"}
_SIGNS = re.compile(r"[\s.*·⋅^_-]")
_PER_SECOND = re.compile(r"(?:/s(?:ec)?|s1)[2²]?$")
_BRACKETED = re.compile(r"[\[(]\s*([^\[\](){}]*?)\s*[\])]")
# Spellings that are a unit wherever they stand; others are only in brackets: `a` and `min`, say.
_UNMISTAKABLE = re.compile(
    r"(?<![^\W\d_])(?:[mun]s|deg(?:rees?)?|mrad|turns|rpm|m?nm|ncm|knm|ma|percent|pct|permille)(?![^\W\d_])|[°º%‰]",
    re.IGNORECASE,
)


def root_of(column: str) -> str:
    """The group whose unit a column of CONTRACT.md has, or a group of them."""
    group = column.rstrip("0123456789")
    return _LIKE.get(group, group)


def find_unit(column: str, text: str) -> str | None:
    """The unit of CONTRACT.md that `text` means for a column, or a group of them; None where it means none."""
    plain, root = _SIGNS.sub("", text).lower(), root_of(column)
    if root in ("qd", "qdd"):
        if plain in _PER_MINUTE:
            return "rpm"
        plain, root = "deg" if plain == "dps" else _PER_SECOND.sub("", plain), "q"
    known = [unit for unit in UNITS.get(root, ()) if unit not in ("index", "rpm")]
    return next((unit for unit in known if plain in (unit.lower(), *_SPELLINGS.get(unit, "").split())), None)


def stated_unit(column: str, name: str) -> str | None:
    """The unit, or whatever is in its place, that the `name` of a column states; None where it states none.

    That is text in brackets, or a word that cannot mean anything else.
    """
    texts = [text for text in _BRACKETED.findall(name) if any(map(str.isalpha, text)) or text in ("°", "%", "‰")]
    texts += [word for word in _UNMISTAKABLE.findall(name) if find_unit(column, word)]
    return next(filter(None, (find_unit(column, text) for text in texts)), texts[-1] if texts else None)


_OF_TOOLS = ("m", "cm", "mm", "N", "kN", "drive")  # units of the tool's positions and forces, mostly


def find_quantity(name: str) -> str | None:
    """The group whose unit stands in brackets in a name that says nothing else: ``M1 [Nm]``."""
    for text in _BRACKETED.findall(name):
        for group in ("q", "tau", "qd"):
            unit = find_unit(group, text)
            if unit is not None and (unit not in _OF_TOOLS or group == "qd"):
                return "i" if unit in ("A", "mA") else group
    return None


def collect_units(texts: Mapping[str, str | None]) -> dict[str, str]:
    """Units by group, or by column where angles and lengths differ. `texts`: what columns of CONTRACT.md state.

    Texts that are no unit, and differ from joint to joint, are names of the joints. All torques have one unit.
    """
    units: dict[str, str] = {}
    for root, known in UNITS.items():
        own = {name: find_unit(root, text) or text for name, text in texts.items() if text and root_of(name) == root}
        distinct = list(dict.fromkeys(own.values()))
        if len(distinct) == 1:
            units[root] = distinct[0]
        elif root == "tau" and set(distinct).intersection(known):
            units[root] = "Nm" if set(distinct) == {"Nm", "N"} else " and ".join(distinct)
        elif set(distinct).intersection(known):
            units |= own
    return units
