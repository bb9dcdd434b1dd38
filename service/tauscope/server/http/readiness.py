"""Whether the service lives and can work: the event loop's heartbeat; database, disk, workers and clock."""

import asyncio
import os
import socket
import tempfile
import threading
import time
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import anyio
from anyio import CapacityLimiter, to_thread

from tauscope.errors import StoreError

BEAT_S = 0.1  # how often the event loop shows that it turns [s]
SILENCE_S = 2.0  # silence of the event loop after which it counts as stuck [s]


class Heartbeat:
    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._last = clock()

    def beat(self) -> None:
        self._last = self._clock()

    def is_alive(self) -> bool:
        return self._clock() - self._last < SILENCE_S

    @asynccontextmanager
    async def keep_beating(self) -> AsyncIterator[None]:
        """Show signs of life as long as the event loop turns, within the context."""
        async with _repeat(self.beat, BEAT_S):
            yield


@asynccontextmanager
async def _repeat(call: Callable[[], object], interval_s: float | None) -> AsyncIterator[None]:
    """Call a function again and again, within the context; never where there is no interval."""

    async def repeat(pause_s: float) -> None:
        while True:
            call()
            await asyncio.sleep(pause_s)

    task = None if interval_s is None else asyncio.create_task(repeat(interval_s))
    try:
        yield
    finally:
        if task is not None:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task


def notify(state: str, environment: Mapping[str, str] = os.environ) -> bool:
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
    notify("READY=1")
    try:
        async with _repeat(lambda: notify("WATCHDOG=1"), watchdog_interval_s()):
            yield
    finally:
        notify("STOPPING=1")


LEAST_FREE_BYTES = 64 * 2**20  # room on the disk below which no run should begin [bytes]
TIMEOUT_S = 2.0  # how long each part may take to answer [s]
EARLIEST = datetime(2026, 1, 1, tzinfo=UTC)
"""A clock before this moment was never set: identifiers, leases and schedules would be wrong."""
MOST_SETBACK_S = 60.0  # how far the clock may be set back while the service runs: items are sorted by it [s]


@dataclass(frozen=True, eq=False)
class Readiness:
    """`checks`: what is asked, by name; each tells an obstacle in a few words, or None, and may hang."""

    checks: Mapping[str, Callable[[], str | None]]
    limiter: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(8))

    async def find_obstacles(self) -> list[str]:
        """All obstacles; a part that does not answer is one."""
        found: dict[str, str | None] = {}

        async def ask(name: str, check: Callable[[], str | None]) -> None:
            found[name] = f"the {name} has not answered within {TIMEOUT_S:g} s"
            with anyio.move_on_after(TIMEOUT_S):
                found[name] = await to_thread.run_sync(check, abandon_on_cancel=True, limiter=self.limiter)

        async with anyio.create_task_group() as group:
            for name, check in self.checks.items():
                group.start_soon(ask, name, check)
        return [obstacle for name in self.checks if (obstacle := found[name]) is not None]


def check_disk(folder: Path) -> str | None:
    """What is wrong with the data folder: a file is really written."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"ready?")
            file.flush()
            os.fsync(file.fileno())
        status = os.statvfs(folder)
    except OSError as error:
        return f"the data folder cannot be written to ({error.strerror})"
    free = status.f_bavail * status.f_frsize
    return None if free >= LEAST_FREE_BYTES else f"the disk has {free // 2**20} MiB left"


def check_database(check: Callable[[], None]) -> str | None:
    try:
        check()
    except StoreError as error:
        return f"database: {error}"
    return None


class Clock:
    """The machine's clock, watched from when the service began."""

    def __init__(self, now: Callable[[], float] = time.time, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._now, self._monotonic = now, monotonic
        self._latest = now() - monotonic()
        self._lock = threading.Lock()

    def check(self) -> str | None:
        now = self._now()
        if now < EARLIEST.timestamp():
            return f"the clock says {datetime.fromtimestamp(now, UTC):%Y-%m-%d}; set it (NTP)"
        with self._lock:
            offset = now - self._monotonic()
            self._latest = max(self._latest, offset)
            back_s = self._latest - offset
        if back_s > MOST_SETBACK_S:
            return f"the clock was set back by {back_s:.0f} s; set it right (NTP), or start the service again"
        return None
