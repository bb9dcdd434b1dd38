"""The clock that a control loop runs by, and the grid of instants on which its cycles are due."""

import time
from typing import Protocol


class Clock(Protocol):
    """A clock that never runs backwards."""

    def now_ns(self) -> int:
        """The present instant [ns]; its origin means nothing."""
        ...

    def wait_until_ns(self, deadline_ns: int) -> int:
        """Return at a deadline, or at once where it has passed.

        Returns
        -------
        int
            the instant of the return [ns]
        """
        ...


class MonotonicClock:
    """The machine's monotonic clock."""

    def now_ns(self) -> int:
        """The present instant [ns]."""
        return time.monotonic_ns()

    def wait_until_ns(self, deadline_ns: int) -> int:
        """Sleep until a deadline; the deadline is absolute, so that lateness does not add up."""
        while (remaining := deadline_ns - time.monotonic_ns()) > 0:
            time.sleep(remaining * 1e-9)
        return time.monotonic_ns()


_EARLY, _LATE = 0.5, 1.9
"""A call that comes so many cycles after the one before is the next. One that comes sooner takes the place of a late
one, in the same cycle; a host that is later has skipped whole cycles."""

_PAUSE = 10
"""After so many cycles without a call the host begins anew, at any instant."""


class CycleGrid:
    """Even instants, one a cycle, laid through the calls that were the earliest."""

    def __init__(self, cycle_s: float) -> None:
        """The first call is in time."""
        self._period_ns = cycle_s * 1e9
        self._due_ns: int | None = None

    def cycles_until(self, now_ns: int) -> int:
        """How many cycles there are since the call before: one, more where some were skipped, none after a late one."""
        if self._due_ns is None:
            self._due_ns = now_ns
            return 1
        waited = (now_ns - self._due_ns) / self._period_ns
        cycles = 1 if _EARLY < waited < _LATE else round(waited)
        due_ns = now_ns if cycles > _PAUSE else self._due_ns + round(cycles * self._period_ns)
        self._due_ns = min(due_ns, now_ns)
        return cycles

    def late_ns(self, now_ns: int) -> int:
        """How long ago the present cycle was due [ns]."""
        return 0 if self._due_ns is None else now_ns - self._due_ns
