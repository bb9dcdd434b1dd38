"""Lines of an audit log, each holding the hash of the one before: no line is changed, moved or left out unseen.

What no chain can show by itself is that its end was cut off, or that all of it was written anew. Note the head now and
then where the machine's owner cannot reach it: `verify` then tells whether that very entry is still there.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

GENESIS = "0" * 64
"""What the first line names as the hash before."""


def chained_line(previous: Mapping[str, Any] | None, content: Mapping[str, Any]) -> bytes:
    """The line that follows another one.

    Parameters
    ----------
    previous : mapping or None
        the entry before; None for the first
    """
    entry = {
        "number": 1 if previous is None else previous["number"] + 1,
        **content,
        "previous": GENESIS if previous is None else previous["hash"],
    }
    return _canonical({**entry, "hash": _digest(entry)})


@dataclass(frozen=True)
class Verification:
    """What a log is worth.

    head : str or None
        hash of the last one; None where there is none
    fault : str or None
        the first thing that is wrong, one line; None where nothing is
    """

    entries: int
    head: str | None
    fault: str | None


def verify_lines(lines: Iterable[bytes], noted: str | None = None) -> Verification:
    """Check every line against the one before."""
    count, head, is_noted_there = 0, GENESIS, noted is None
    torn: bytes | None = None
    for place, line in enumerate(lines, start=1):
        entry = parse_entry(line)
        if entry is None and torn is None and not is_line_of_ours(line):
            torn = line.rstrip(b"\n")
            continue
        fault = _fault(entry, count + 1, head, torn)
        if entry is None or fault is not None:
            return Verification(count, head if count else None, f"line {place}: {fault or 'is damaged'}")
        count, head, torn = count + 1, entry["hash"], None
        is_noted_there = is_noted_there or head == noted
    head_or_none = head if count else None
    if torn is not None:
        return Verification(count, head_or_none, "the last line is cut off: a crash, or somebody's hand")
    fault = None if is_noted_there else f"no entry has the hash {noted}: the log was cut or written anew"
    return Verification(count, head_or_none, fault)


def parse_entry(line: bytes) -> dict[str, Any] | None:
    """The entry of a whole line; None where it is none."""
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        return None
    is_entry = isinstance(entry, dict) and isinstance(entry.get("number"), int) and isinstance(entry.get("hash"), str)
    return entry if is_entry else None


def is_line_of_ours(line: bytes) -> bool:
    """Whether a line is whole JSON, so that no crash can have cut it off."""
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


def _fault(entry: dict[str, Any] | None, number: int, previous: str, torn: bytes | None) -> str | None:
    """What is wrong with an entry in its place."""
    if entry is None:
        return "is damaged"
    rest = {name: value for name, value in entry.items() if name != "hash"}
    if _digest(rest) != entry["hash"]:
        return "was changed: its hash is another one"
    if entry["number"] != number or entry.get("previous") != previous:
        return f"does not follow the line before: entry {number} is missing or was moved"
    if torn is not None and entry.get("torn_bytes") != len(torn):
        return "the line before is damaged, and no crash explains it"
    return None


def _digest(entry: Mapping[str, Any]) -> str:
    """The hash of everything that an entry says, the hash of the entry before included."""
    return hashlib.sha256(_canonical(entry)).hexdigest()


def _canonical(entry: Mapping[str, Any]) -> bytes:
    """One spelling of the same data."""
    return json.dumps(entry, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
