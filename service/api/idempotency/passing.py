"""Answers that are kept in memory: those that hold a secret, of what ends with the service anyway."""

import threading
import time
from collections.abc import Callable

from service.api.idempotency.answers import LIFE_S, KeptAnswer

MOST = 1000
"""Requests that are remembered; beyond it the oldest is forgotten."""


class PassingAnswers:
    """Answers by the name of their request, none of which is ever written to a disk."""

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

    def begin(self, name: str) -> bool:
        """Claim a request before anything is done.

        Parameters
        ----------
        name : str
            of the request, see `request_name`

        Returns
        -------
        bool
            False where the request was begun before
        """
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

    def finish(self, name: str, answer: KeptAnswer | None) -> None:
        """Keep the answer, or forget a request that did nothing.

        Parameters
        ----------
        name : str
            of the request
        answer : KeptAnswer or None
            what was answered; None to forget
        """
        with self._lock:
            if answer is None:
                self._kept.pop(name, None)
            elif name in self._kept:
                self._kept[name] = (self._kept[name][0], answer)

    def find(self, name: str) -> KeptAnswer | None:
        """The answer to a request; None where there is none (yet).

        Parameters
        ----------
        name : str
            of the request
        """
        with self._lock:
            return self._kept.get(name, (0.0, None))[1]

    def _oldest(self) -> str:
        """The request that was begun first."""
        return next(iter(self._kept))
