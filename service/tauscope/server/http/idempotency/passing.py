"""Answers that are kept in memory: those that hold a secret, of what ends with the service anyway."""

import threading
import time
from collections.abc import Callable

from typing_extensions import override

from tauscope.server.http.idempotency.answers import LIFE_S, Answers, KeptAnswer

MOST = 1000
"""Requests that are remembered; beyond it the oldest is forgotten."""


class PassingAnswers(Answers):
    """Answers none of which is ever written to a disk."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin without any.

        Parameters
        ----------
        clock : callable
            by which they age [s]
        """
        self._clock = clock
        self._lock = threading.Lock()
        self._kept: dict[str, tuple[float, KeptAnswer | None]] = {}

    @override
    def begin(self, name: str) -> bool:
        now = self._clock()
        with self._lock:
            while self._kept and now - self._kept[self._oldest()][0] > LIFE_S:
                del self._kept[self._oldest()]
            if name in self._kept:
                return False
            if len(self._kept) == MOST:
                del self._kept[self._oldest()]
            self._kept[name] = (now, None)
            return True

    @override
    def finish(self, name: str, answer: KeptAnswer | None) -> None:
        with self._lock:
            if answer is None:
                self._kept.pop(name, None)
            elif name in self._kept:
                self._kept[name] = (self._kept[name][0], answer)

    @override
    def find(self, name: str) -> KeptAnswer | None:
        with self._lock:
            return self._kept.get(name, (0.0, None))[1]

    def _oldest(self) -> str:
        """The request that was begun first."""
        return next(iter(self._kept))
