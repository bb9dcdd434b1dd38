"""Foreign text made fit for a message of one line."""

from collections.abc import Sequence

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
