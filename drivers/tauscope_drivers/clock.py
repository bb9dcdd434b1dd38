"""The clock that a control loop runs by: the machine's, or one that waits as fast as a simulation computes."""

import time
from typing import Protocol


class Clock(Protocol):
    """A clock that never runs backwards."""

    def now_ns(self) -> int:
        """The present instant [ns]; its origin means nothing."""
        ...

    def wait_until_ns(self, deadline_ns: int) -> int:
        """Return at a deadline, or at once where it has passed.

        Parameters
        ----------
        deadline_ns : int
            absolute instant [ns]

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
        """Sleep until a deadline; the deadline is absolute, so that lateness does not add up.

        Parameters
        ----------
        deadline_ns : int
            absolute instant [ns]
        """
        while (remaining := deadline_ns - time.monotonic_ns()) > 0:
            time.sleep(remaining * 1e-9)
        return time.monotonic_ns()
