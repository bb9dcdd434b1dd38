"""Tells a test against the clock that failed from a machine that stood still under it.

Machines are shared: the whole of one may be taken away for a tenth of a second, which no program can make good, or
more programs may run than it has processors. A test of mark `realtime` that fails while that was seen to happen raises
`MachineStoodStillError`, and is run again (``make test-slow``). A test that fails without it has failed. On a machine
too slow for emulated devices, which is measured, a failure was to be expected, and is told as one; so is the last of a
test's runs, where the host's other machines, not this one's programs, took the time of every one.
"""

import os
import threading
import time
from collections.abc import Generator
from types import TracebackType
from typing import Any, Self

import pytest

import machine_speed

PERIOD_S = 0.005
STANDSTILL_S = 0.025
"""Six cycles of 250 Hz: more than a control loop with a real-time priority ever waits for another program [s]."""
MOST_TAKEN = 0.1
"""Part of a test's time up to which what other machines took of a processor does not count."""
MOST_WAITED = 0.6
"""Part of a test's time up to which it does not count that programs of this machine waited for a processor."""
TAKEN_PARTS = pytest.StashKey[list[float]]()
"""What they took in each of a test's failed runs."""


class MachineStoodStillError(Exception):
    """A test failed, and the machine stood still meanwhile."""


class Onlooker:
    """Sleeps for short whiles on every processor, each may stand still alone, and notes the longest oversleeping."""

    def __init__(self) -> None:
        self._longest_s = dict.fromkeys(os.sched_getaffinity(0), 0.0)
        self._ended = threading.Event()
        self._threads = [threading.Thread(target=self._look, args=(cpu,), daemon=True) for cpu in self._longest_s]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        for thread in self._threads:
            thread.join()

    @property
    def longest_s(self) -> float:
        """For how long one of the processors stood still [s]."""
        return max(self._longest_s.values())

    def _look(self, cpu: int) -> None:
        os.sched_setaffinity(0, {cpu})
        before = time.monotonic()
        while not self._ended.wait(PERIOD_S):
            now = time.monotonic()
            self._longest_s[cpu] = max(self._longest_s[cpu], now - before - PERIOD_S)
            before = now


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, Any, Any]:
    if item.get_closest_marker("realtime") is None:
        return (yield)
    with Onlooker() as onlooker:
        begin, taken, waited = time.monotonic(), machine_speed.taken_s(), machine_speed.waited_s()
        try:
            return (yield)
        except (Exception, pytest.fail.Exception) as error:
            lasted_s = time.monotonic() - begin
            taken_part = (machine_speed.taken_s() - taken) / lasted_s
            waited_part = (machine_speed.waited_s() - waited) / max(lasted_s, machine_speed.WAITED_EVERY_S)
            why = str(error).partition("\n")[0]
            if (step_s := machine_speed.physics_step_s()) > machine_speed.QUICK_ENOUGH_S:
                pytest.xfail(f"too slow a machine ({1e3 * step_s:.2f} ms for a step of the physics): {why}")
            runs = item.stash.setdefault(TAKEN_PARTS, [])
            runs.append(taken_part)
            if min(runs) > MOST_TAKEN and _is_last_run(item):
                pytest.xfail(f"other machines took {taken_part:.0%} of a processor, run after run: {why}")
            if taken_part <= MOST_TAKEN and waited_part <= MOST_WAITED and onlooker.longest_s < STANDSTILL_S:
                raise
            account = f"for {1e3 * onlooker.longest_s:.0f} ms, {taken_part:.0%} of a processor was taken from it, and"
            account += f" for {waited_part:.0%} of the time a program waited for one"
            raise MachineStoodStillError(f"{account}; the test failed: {error}") from error


def _is_last_run(item: pytest.Item) -> bool:
    """Whether a failing test would not be run again; never where it was not to be run again at all."""
    reruns = item.config.getoption("reruns", default=None) or 0
    return 0 < reruns < getattr(item, "execution_count", 0)
