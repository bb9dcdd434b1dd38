"""A clock that stands still until somebody waits: time passes as fast as the simulation computes."""

from collections.abc import Callable


class VirtualClock:
    """The clock of a simulated device; waiting carries the device forward.

    Parameters
    ----------
    start_ns : int
        its first instant [ns]
    advance : callable
        lets the device live up to an instant [ns]
    """

    def __init__(self, start_ns: int, advance: Callable[[int], None]) -> None:
        self._now_ns = start_ns
        self._advance = advance

    def now_ns(self) -> int:
        """The present instant [ns]."""
        return self._now_ns

    def wait_until_ns(self, deadline_ns: int) -> int:
        """Let the device live up to a deadline, and return there; at once where it has passed.

        Parameters
        ----------
        deadline_ns : int
            absolute instant [ns]
        """
        if deadline_ns > self._now_ns:
            self._now_ns = deadline_ns
            self._advance(deadline_ns)
        return self._now_ns
