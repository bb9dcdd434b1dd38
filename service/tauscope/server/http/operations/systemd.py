"""The service's word to systemd: that it is ready, that it is alive, that it ends. Nothing without systemd."""

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress


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
async def told() -> AsyncIterator[None]:
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
