"""Real-time scheduling of the loop, the deadlines of its cycles, and how late they were."""

import ctypes
import gc
import os
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tauscope.strict_model import StrictModel
from tauscope_drivers import Clock

PRIORITY = 80  # real-time priority of the loop: above the drivers of most devices, below the kernel's own threads
BESIDE = 20  # by how much the other threads of the process are below the loop
_TASKS = Path("/proc/self/task")
_LOCK_CURRENT_AND_FUTURE = 3


class RealTime(StrictModel):
    scheduler: str = Field(description="fifo with its priority, or why the ordinary scheduler was used")
    memory_locked: bool = Field(description="whether no page of the process could be swapped out")
    collector_frozen: bool = Field(description="whether Python's garbage collector stood still")


SIMULATED_TIME = RealTime(scheduler="virtual time needs none", memory_locked=False, collector_frozen=False)
"""In virtual time a loop is never late."""


@contextmanager
def real_time() -> Iterator[RealTime]:
    """Run the calling thread as real-time as the system permits, and as an ordinary one afterwards.

    The other threads that there are become real-time too, below it: one that holds the interpreter's lock, and is kept
    from its processor by another program, would hold up the loop as well.
    """
    try:
        locked = _library().mlockall(_LOCK_CURRENT_AND_FUTURE) == 0
    except (OSError, AttributeError):
        locked = False
    gc.collect()
    gc.freeze()
    gc.disable()
    refusal = _enter_real_time()
    try:
        scheduler = f"fifo {PRIORITY}" if refusal is None else f"ordinary: SCHED_FIFO was refused ({refusal})"
        yield RealTime(scheduler=scheduler, memory_locked=locked, collector_frozen=True)
    finally:
        for thread in _threads():
            _schedule(thread, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, 0)  # only root may take that flag back
        gc.enable()
        gc.unfreeze()
        if locked:
            _library().munlockall()


def _enter_real_time() -> str | None:
    """Ask for SCHED_FIFO, which child processes and new threads do not inherit; why it was refused, None where not."""
    own = threading.get_native_id()
    priorities = {own: PRIORITY} | {thread: PRIORITY - BESIDE for thread in _threads() if thread != own}
    try:
        for thread, its_priority in priorities.items():
            _schedule(thread, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, its_priority)
    except (OSError, ValueError) as error:
        return error.strerror if isinstance(error, OSError) else str(error)
    return None


def _threads() -> list[int]:
    try:
        return [int(task.name) for task in _TASKS.iterdir()]
    except OSError:
        return []


def _schedule(thread: int, policy: int, priority: int) -> None:
    """Schedule a thread, unless it has ended meanwhile."""
    with suppress(ProcessLookupError):
        os.sched_setscheduler(thread, policy, os.sched_param(priority))


def _library() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


_HISTOGRAM_EDGES_US = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000)
_PERCENTILES = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9, "max": 100.0}


class Timing(StrictModel):
    rate_hz: float = Field(description="cycles a second that were asked for")
    achieved_rate_hz: float | None = Field(description="cycles by the time they took; null for less than two")
    cycles: int = Field(description="cycles that took place")
    missed_periods: int = Field(description="cycles that were left out because the loop was late")
    stale_samples: tuple[int, ...] = Field(description="readings that did not come in time, one number a joint")
    lateness_us: Mapping[str, float] = Field(description="lateness behind the deadlines: p50, p99, p99.9, max")
    histogram_us: tuple[tuple[float | None, int], ...] = Field(
        description="upper edge and number of cycles of each bin of the lateness; the last bin has no edge"
    )


class Metronome:
    """Absolute deadlines at a constant rate; one that was slept through is left out and counted, never made up."""

    def __init__(self, clock: Clock, start_ns: int, period_ns: int, cycles: int) -> None:
        """Set the first deadline. `start_ns`: first deadline [ns]; `period_ns`: time between deadlines [ns]."""
        self._clock, self._start, self._period, self._cycles = clock, start_ns, period_ns, cycles
        self._lateness: NDArray[np.int64] = np.zeros(cycles, dtype=np.int64)
        self._next = 0
        self.index = -1
        self.due_ns = start_ns
        self.lateness_ns = 0
        self.missed = 0
        self.played = 0

    def wait(self) -> bool:
        """Wait for the next deadline that is not a whole period past, its `index`; False where there is none left."""
        if self._next >= self._cycles:
            return False
        due = self._start + self._next * self._period
        lateness = self._clock.wait_until_ns(due) - due
        skipped = min(lateness // self._period, self._cycles - 1 - self._next) if lateness >= self._period else 0
        self.missed += skipped
        self.index = self._next + skipped
        self.due_ns = due + skipped * self._period
        # What counts is the lateness of the wake-up, also where it cost whole periods.
        self.lateness_ns = lateness
        self._lateness[self.played] = lateness
        self.played += 1
        self._next = self.index + 1
        return True

    def timing(self, stale: NDArray[np.int64]) -> Timing:
        """The account so far. `stale`: (n,) int64, readings that each joint did not answer."""
        late_us = self._lateness[: self.played] * 1e-3
        span_s = self.index * self._period * 1e-9
        bins = np.searchsorted(_HISTOGRAM_EDGES_US, late_us, side="right")
        counts = np.bincount(bins, minlength=len(_HISTOGRAM_EDGES_US) + 1)
        return Timing(
            rate_hz=1e9 / self._period,
            achieved_rate_hz=(self.played - 1) / span_s if self.played > 1 else None,
            cycles=self.played,
            missed_periods=self.missed,
            stale_samples=tuple(int(count) for count in stale),
            lateness_us=lateness_percentiles(late_us),
            histogram_us=tuple(zip((*map(float, _HISTOGRAM_EDGES_US), None), map(int, counts), strict=True)),
        )

    def recent_lateness_us(self, cycles: int) -> Mapping[str, float]:
        """Percentiles of the last cycles' lateness [µs]."""
        return lateness_percentiles(self._lateness[max(self.played - cycles, 0) : self.played] * 1e-3)


def lateness_percentiles(lateness_us: NDArray[np.floating]) -> dict[str, float]:
    """Median, tail and largest value, by name; empty where there is no value. `lateness_us`: (N,) [µs]."""
    if not len(lateness_us):
        return {}
    values = np.percentile(lateness_us, list(_PERCENTILES.values()))
    return {name: round(float(value), 1) for name, value in zip(_PERCENTILES, values, strict=True)}
