"""Signs of life: the heartbeat of the event loop, which an arm in real time needs, and notifications to systemd."""

import asyncio
import os
import socket
import time
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress

BEAT_S = 0.1
"""How often the event loop shows that it turns [s]."""

TIMEOUT_S = 2.0
"""Silence of the event loop after which it counts as stuck [s]."""


class Heartbeat:
    """The last sign of life of the event loop."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._last = clock()

    def beat(self) -> None:
        """Show a sign of life."""
        self._last = self._clock()

    def is_alive(self) -> bool:
        """Whether the last sign of life is recent."""
        return self._clock() - self._last < TIMEOUT_S

    @asynccontextmanager
    async def keep_beating(self) -> AsyncIterator[None]:
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


def notify(state: str, environment: Mapping[str, str] = os.environ) -> bool:
    """Tell systemd a state."""
    address = environment.get("NOTIFY_SOCKET", "")
    if not address.startswith(("/", "@")):
        return False
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as channel:
        try:
            channel.sendto(state.encode(), address.replace("@", "\0", 1) if address[0] == "@" else address)
        except OSError:
            return False
    return True


def watchdog_interval_s(environment: Mapping[str, str] = os.environ) -> float | None:
    """How often systemd wants a sign of life, halved; None where it wants none [s]."""
    text = environment.get("WATCHDOG_USEC", "")
    is_ours = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
    return int(text) * 0.5e-6 if text.isdecimal() and int(text) > 0 and is_ours else None


@asynccontextmanager
async def notify_systemd() -> AsyncIterator[None]:
    """Say that the service is ready, give signs of life as long as the event loop turns, and say that it ends."""

    async def live(interval_s: float) -> None:
        while True:
            notify("WATCHDOG=1")
            await asyncio.sleep(interval_s)

    interval_s = watchdog_interval_s()
    task = None if interval_s is None else asyncio.create_task(live(interval_s))
    notify("READY=1")
    try:
        yield
    finally:
        notify("STOPPING=1")
        if task is not None:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task
