"""How often somebody may call: buckets that fill at a steady rate, one a caller."""

import time
from collections import OrderedDict
from collections.abc import Callable

MOST_CALLERS = 10_000
"""Callers that are remembered; the one that was silent longest is forgotten first."""


class RateLimit:
    """Token buckets. Used by the event loop only, so that it needs no lock."""

    def __init__(self, per_second: float, burst: float, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin with full buckets.

        Parameters
        ----------
        per_second : float
            how often a caller may call in the long run [1/s]
        """
        self._rate, self._burst, self._clock = per_second, burst, clock
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def take(self, caller: str) -> float:
        """Count a call.

        Returns
        -------
        float
            0 where the call may pass; else the time after which the next one may [s]
        """
        now = self._clock()
        tokens, then = self._buckets.pop(caller, (self._burst, now))
        tokens = min(self._burst, tokens + (now - then) * self._rate)
        wait = 0.0 if tokens >= 1.0 else (1.0 - tokens) / self._rate
        self._buckets[caller] = (tokens if wait else tokens - 1.0, now)
        if len(self._buckets) > MOST_CALLERS:
            self._buckets.popitem(last=False)
        return wait
