"""Whether requests are answered: arms only move while somebody could stop them through this service."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress

BEAT_S = 0.1
"""How often the event loop shows that it turns [s]."""

PATIENCE_S = 2.0
"""Silence of the event loop after which it counts as stuck [s]."""


class Heartbeat:
    """The last sign of life of the event loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin alive."""
        self._clock = clock
        self._last = clock()

    def beat(self) -> None:
        """Show a sign of life."""
        self._last = self._clock()

    def is_felt(self) -> bool:
        """Whether the last sign of life is recent."""
        return self._clock() - self._last < PATIENCE_S

    @asynccontextmanager
    async def beating(self) -> AsyncIterator[None]:
        """Show signs of life as long as the event loop turns, within the context."""

        async def beat() -> None:
            while True:
                self.beat()
                await asyncio.sleep(BEAT_S)

        task = asyncio.create_task(beat())
        try:
            yield
        finally:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task
