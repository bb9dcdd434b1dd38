"""When the master's bytes came: a thread notes it, for the devices may just be busy with a step of their physics.

A drive samples when SYNC comes. Emulated ones that take it for having come when they get round to it sample up to a
step later than the master believes, and that is read as a disturbance of the motion.
"""

import contextlib
import os
import select
import sys
import threading
import time
from types import TracebackType
from typing import Self

from tauscope_sim.emulation.emulator import Port

_SWITCH_S = 5e-5
"""How long the thread waits for the interpreter at most [s]."""

_AWAY_S = 0.001
"""How often it is looked for a master that is not there [s]."""

_NICE = -20
"""No real-time priority: what carries bytes through a pseudo terminal is a thread of the kernel without one."""


class Arrivals:
    """Bytes that a port has received, each piece with its instant, as long as the ``with`` block lasts."""

    def __init__(self, port: Port) -> None:
        """Nothing is received yet."""
        self._port = port
        self._pieces: list[tuple[bytes, int]] = []
        self._lock = threading.Lock()
        self._wake = os.eventfd(0, os.EFD_NONBLOCK)
        self._end = os.eventfd(0)
        self._thread = threading.Thread(target=self._receive, daemon=True)

    def __enter__(self) -> Self:
        sys.setswitchinterval(_SWITCH_S)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.eventfd_write(self._end, 1)
        self._thread.join()
        os.close(self._wake)
        os.close(self._end)

    def fileno(self) -> int:
        """Descriptor to wait on."""
        return self._wake

    def take(self) -> tuple[list[tuple[bytes, int]], int]:
        """What came since the last call, the oldest first, and the instant before which nothing more has come."""
        with contextlib.suppress(BlockingIOError):
            os.eventfd_read(self._wake)
        with self._lock:
            pieces, self._pieces = self._pieces, []
            return pieces, time.monotonic_ns()

    def _receive(self) -> None:
        """Wait, note the instant, read."""
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        while self._end not in select.select([self._port, self._end], [], [])[0]:
            with self._lock:
                now_ns = time.monotonic_ns()
                received = self._port.read()
                if received:
                    self._pieces.append((received, now_ns))
            if received:
                os.eventfd_write(self._wake, 1)
            elif received is None and select.select([self._end], [], [], _AWAY_S)[0]:
                return
