"""Messages about a user's files: findings, and foreign text made fit for one line."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from enum import StrEnum
from itertools import islice

from pydantic import Field

from tauscope.strict_model import entry

_LISTED_NAMES = 12
_LONGEST_NAME = 60


def printable(text: str, longest: int = 200) -> str:
    """Text without control characters and line breaks, cut where it is long."""
    kept = text if len(text) <= longest else text[:longest] + "…"
    return kept if kept.isprintable() else "".join(mark if mark.isprintable() else "?" for mark in kept)


def listed(names: Sequence[str]) -> str:
    """Names of columns, joints or topics, cut where they are many."""
    words = [printable(name, _LONGEST_NAME) for name in names[:_LISTED_NAMES]]
    more = f" and {len(names) - _LISTED_NAMES} more" if len(names) > _LISTED_NAMES else ""
    return ", ".join(words) + more


def reason(error: Exception) -> str:
    """The first line of what an error says, or its kind where it says nothing."""
    return printable((str(error).splitlines() or [""])[0]) or type(error).__name__


class Severity(StrEnum):
    """How much a finding matters: an error refuses, a warning may spoil results, the rest is good to know."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


@entry
class Finding:
    """One remark on a robot or a recording."""

    severity: Severity = Field(description="warning: may spoil results; info: good to know")
    where: str = Field(description="file and place, or column, that it is about")
    text: str = Field(description="what is so, and what to do about it")


LONGEST_VALUE = 60
MOST_CANDIDATES = 1000


def shown(value: object) -> str:
    """A value of the user's file as a message shows it: quoted text, and cut where it is long."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and abs(value) >= 10**LONGEST_VALUE:
        return f"an integer of {value.bit_length()} bits"
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 1] + "…"


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint at what was meant: the known name nearest to `name`, or the known names where none is near."""
    names = sorted(islice(known, MOST_CANDIDATES))
    match = get_close_matches(name[:200], names, n=1, cutoff=0.6)
    if match:
        return f"did you mean {match[0]!r}?"
    few = ", ".join(names[:12])
    return f"known here: {few}{', …' if len(names) > 12 else ''}" if names else "none is known here"
