"""What a process does to keep its time: real-time scheduling, locked memory, no garbage collection in the loop."""

import ctypes
import gc
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pydantic import Field

from tauscope.runtime.stored import StoredModel

PRIORITY = 80
"""Real-time priority of the loop: above the drivers of most devices, below the kernel's own threads."""

BESIDE = 20
"""By how much the other threads of the process are below the loop."""

_TASKS = Path("/proc/self/task")
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
    """Run the calling thread as real-time as the system permits, and as an ordinary one afterwards.

    The other threads that there are become real-time too, below it: one that holds the interpreter's lock, and is kept
    from its processor by another program, would hold up the loop as well.
    """
    locked = _lock_memory()
    gc.collect()
    gc.freeze()
    gc.disable()
    refusal = _enter_real_time(priority)
    try:
        scheduler = f"fifo {priority}" if refusal is None else f"ordinary: SCHED_FIFO was refused ({refusal})"
        yield RealTime(scheduler=scheduler, memory_locked=locked, collector_frozen=True)
    finally:
        for thread in _threads():
            _schedule(thread, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, 0)  # only root may take that flag back
        gc.enable()
        gc.unfreeze()
        if locked:
            _library().munlockall()


def _enter_real_time(priority: int) -> str | None:
    """Ask for SCHED_FIFO, which child processes and new threads do not inherit; why it was refused, None where not."""
    own = threading.get_native_id()
    priorities = {own: priority} | {thread: priority - BESIDE for thread in _threads() if thread != own}
    try:
        for thread, its_priority in priorities.items():
            _schedule(thread, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, its_priority)
    except (OSError, ValueError) as error:
        return error.strerror if isinstance(error, OSError) else str(error)
    return None


def _threads() -> list[int]:
    """The threads of this process; none where the system does not list them."""
    try:
        return [int(task.name) for task in _TASKS.iterdir()]
    except OSError:
        return []


def _schedule(thread: int, policy: int, priority: int) -> None:
    """Schedule a thread, unless it has ended meanwhile."""
    with suppress(ProcessLookupError):
        os.sched_setscheduler(thread, policy, os.sched_param(priority))


def _lock_memory() -> bool:
    """Ask for all pages to stay in memory."""
    try:
        return _library().mlockall(_LOCK_CURRENT_AND_FUTURE) == 0
    except (OSError, AttributeError):
        return False


def _library() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)
