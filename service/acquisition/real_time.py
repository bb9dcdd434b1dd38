"""What a process does to keep its time: real-time scheduling, locked memory, no garbage collection in the loop."""

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager

from pydantic import Field

from service.acquisition.stored import StoredModel

PRIORITY = 80
"""Real-time priority of the loop: above the drivers of most devices, below the kernel's own threads."""

_LOCK_CURRENT_AND_FUTURE = 3


class RealTime(StoredModel):
    """What the loop was given of what it asked for."""

    scheduler: str = Field(description="fifo with its priority, or why the ordinary scheduler was used")
    memory_locked: bool = Field(description="whether no page of the process could be swapped out")
    collector_frozen: bool = Field(description="whether Python's garbage collector stood still")


SIMULATED_TIME = RealTime(scheduler="virtual time needs none", memory_locked=False, collector_frozen=False)
"""In virtual time a loop is never late."""


@contextmanager
def real_time(priority: int = PRIORITY) -> Iterator[RealTime]:
    """Run the calling thread as real-time as the system permits, and as before afterwards.

    Parameters
    ----------
    priority : int
        of SCHED_FIFO, 1 to 99

    Yields
    ------
    RealTime
        what was permitted
    """
    locked = _lock_memory()
    gc.collect()
    gc.freeze()
    gc.disable()
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    scheduler = _schedule(priority)
    try:
        yield RealTime(scheduler=scheduler, memory_locked=locked, collector_frozen=True)
    finally:
        if scheduler.startswith("fifo"):
            os.sched_setscheduler(0, *before)
        gc.enable()
        gc.unfreeze()
        if locked:
            _library().munlockall()


def _schedule(priority: int) -> str:
    """Ask for SCHED_FIFO; child processes and threads do not inherit it."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        return f"ordinary: SCHED_FIFO was refused ({reason})"
    return f"fifo {priority}"


def _lock_memory() -> bool:
    """Ask for all pages to stay in memory."""
    try:
        return _library().mlockall(_LOCK_CURRENT_AND_FUTURE) == 0
    except (OSError, AttributeError):
        return False


def _library() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)
