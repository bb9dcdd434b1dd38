"""Tells a test against the clock that failed from a machine that stood still under it.

Machines are shared: the whole of one may be taken away for a tenth of a second, which no program can make good. A test
of mark `realtime` that fails while that was seen to happen raises `MachineStoodStillError`, and is run again
(``make test-slow``). A test that fails without it has failed.
"""

import threading
import time
from collections.abc import Generator
from types import TracebackType
from typing import Any, Self

import pytest

PERIOD_S = 0.005
STANDSTILL_S = 0.025
"""Six cycles of 250 Hz: more than a control loop with a real-time priority ever waits for another program [s]."""


class MachineStoodStillError(Exception):
    """A test failed, and the machine stood still meanwhile."""


class Onlooker:
    """Sleeps for short whiles and notes the longest by which it overslept."""

    def __init__(self) -> None:
        self.longest_s = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()

    def _look(self) -> None:
        before = time.monotonic()
        while not self._ended.wait(PERIOD_S):
            now = time.monotonic()
            self.longest_s = max(self.longest_s, now - before - PERIOD_S)
            before = now


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    if item.get_closest_marker("realtime") is None:
        return (yield)
    with Onlooker() as onlooker:
        try:
            return (yield)
        except (Exception, pytest.fail.Exception) as error:
            if onlooker.longest_s < STANDSTILL_S:
                raise
            raise MachineStoodStillError(f"for {1e3 * onlooker.longest_s:.0f} ms; the test failed: {error}") from error
