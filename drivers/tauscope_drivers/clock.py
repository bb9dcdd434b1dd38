"""The clock of drivers, and how long they wait for an answer."""

import time
from collections import deque
from statistics import median
from typing import Protocol

REMEMBERED = 31  # answers by which it is known how long they usually take: adapters differ


class AnswerTime:
    """Compares how long each answer took with the median of the last ones."""

    def __init__(self) -> None:
        self._taken_ns: deque[int] = deque(maxlen=REMEMBERED)

    @property
    def usual_ns(self) -> int:
        """Median of the last answers' times; 0 where there was none [ns]."""
        return round(median(self._taken_ns)) if self._taken_ns else 0

    def late_ns(self, taken_ns: int) -> int:
        """How much later than usual an answer came [ns]. `taken_ns`: from the question to the answer's end [ns]."""
        self._taken_ns.append(taken_ns)
        return max(0, taken_ns - self.usual_ns)


class Clock(Protocol):
    """A clock that never runs backwards."""

    def now_ns(self) -> int:
        """The present instant [ns]; its origin means nothing."""
        ...

    def wait_until_ns(self, deadline_ns: int) -> int:
        """Return at a deadline, or at once where it has passed. Returns int: the instant of the return [ns]."""
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

_PAUSE = 10  # after so many cycles without a call the host begins anew, at any instant


class CycleGrid:
    """Even instants, one a cycle, laid through the calls that were the earliest."""

    def __init__(self, cycle_s: float) -> None:
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
