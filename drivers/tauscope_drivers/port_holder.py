"""Who holds a serial port, as far as the system tells."""

import os
from pathlib import Path

_PROCESSES = Path("/proc")


def find_holder(path: str) -> str | None:
    """The process that has a port open, as ``process 123 (name)``; None where none is seen.

    Processes of other users show their open files only to the superuser.
    """
    try:
        wanted = os.stat(path).st_rdev
    except OSError:
        return None
    for entry in _PROCESSES.iterdir():
        if entry.name.isdigit() and _has_open(entry, wanted):
            return f"process {entry.name} ({_name(entry)})"
    return None


def _has_open(process: Path, device: int) -> bool:
    """Whether a process has a device open."""
    try:
        return any(_device(descriptor) == device for descriptor in (process / "fd").iterdir())
    except OSError:
        return False


def _device(descriptor: Path) -> int | None:
    try:
        return os.stat(descriptor).st_rdev or None
    except OSError:
        return None


def _name(process: Path) -> str:
    try:
        return (process / "comm").read_text().strip() or "unnamed"
    except OSError:
        return "unnamed"
