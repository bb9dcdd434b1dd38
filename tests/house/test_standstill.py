"""A test against the clock is run again only where the machine stood still under it."""

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import pytest

import machine_speed
import standstill

pytest_plugins = ["pytester"]

FAILS_AT_FIRST = """
import ctypes, pathlib
import pytest

@pytest.mark.realtime
def test_against_the_clock():
    ctypes.PyDLL(None).usleep({microseconds})  # keeps the interpreter's lock: nothing in this process runs meanwhile
    seen = pathlib.Path("seen")
    is_first = not seen.exists()
    seen.touch()
    assert not is_first
"""


FAILS_ALWAYS = """
import ctypes
import pytest

@pytest.mark.realtime
def test_against_the_clock():
    ctypes.PyDLL(None).usleep({microseconds})
    assert False
"""


def outcomes(
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    test: str,
    *,
    step_s: float = machine_speed.QUICK_ENOUGH_S,
    taken_s: Sequence[float] = (0.0, 0.0),
    waited_s: Sequence[float] = (0.0, 0.0),
) -> Any:
    """What is said of a test where a step of the physics takes so long, and so much is lost in its two runs."""
    monkeypatch.setattr(machine_speed, "physics_step_s", lambda: step_s)
    for name, lost in {"taken_s": taken_s, "waited_s": waited_s}.items():
        readings = itertools.accumulate(itertools.chain.from_iterable((0.0, each) for each in lost))
        monkeypatch.setattr(machine_speed, name, readings.__next__)
    monkeypatch.setattr(standstill, "STANDSTILL_S", 0.2)  # no busy machine stands still for so long by itself
    pytester.makeini("[pytest]\nmarkers = realtime\n")
    pytester.makepyfile(test)
    result = pytester.runpytest_inprocess("-p", "standstill", "--reruns", "1", "--only-rerun", "MachineStoodStill")
    return result.parseoutcomes()


@pytest.mark.parametrize(("microseconds", "outcome"), [(300_000, {"passed": 1, "rerun": 1}), (0, {"failed": 1})])
def test_a_failure_counts_unless_the_machine_stood_still(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, microseconds: int, outcome: dict[str, int]
) -> None:
    test = FAILS_AT_FIRST.format(microseconds=microseconds)
    assert outcomes(pytester, monkeypatch, test) == outcome


@pytest.mark.slow
@pytest.mark.parametrize("microseconds", [300_000, 0])
def test_a_failure_is_expected_of_a_machine_that_is_too_slow(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, microseconds: int
) -> None:
    test = FAILS_AT_FIRST.format(microseconds=microseconds)
    assert outcomes(pytester, monkeypatch, test, step_s=1.01 * machine_speed.QUICK_ENOUGH_S) == {"xfailed": 1}


@pytest.mark.parametrize(("taken_s", "waited_s"), [(60.0, 0.0), (0.0, 60.0)])
def test_a_machine_whose_time_is_taken_is_given_another_run(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, taken_s: float, waited_s: float
) -> None:
    test = FAILS_AT_FIRST.format(microseconds=0)
    told = outcomes(pytester, monkeypatch, test, taken_s=(taken_s, 0.0), waited_s=(waited_s, 0.0))
    assert told == {"passed": 1, "rerun": 1}


@pytest.mark.slow
@pytest.mark.parametrize(("microseconds", "taken_s", "outcome"), [
    (0, (60.0, 60.0), {"xfailed": 1, "rerun": 1}),
    (0, (60.0, 0.0), {"failed": 1, "rerun": 1}),
    (0, (0.0, 0.0), {"failed": 1}),
    (300_000, (0.0, 60.0), {"failed": 1, "rerun": 1}),  # the first run had the machine, and kept it itself
])  # fmt: skip
def test_what_never_had_the_machine_has_not_failed(
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    microseconds: int,
    taken_s: Sequence[float],
    outcome: dict[str, int],
) -> None:
    test = FAILS_ALWAYS.format(microseconds=microseconds)
    assert outcomes(pytester, monkeypatch, test, taken_s=taken_s) == outcome


@pytest.mark.parametrize("lost_s", [machine_speed.taken_s, machine_speed.waited_s])
def test_what_was_lost_only_grows(lost_s: Callable[[], float]) -> None:
    before = lost_s()
    assert 0.0 <= before <= lost_s()


def test_the_machine_s_speed_is_that_of_the_physics() -> None:
    assert 1e-6 < machine_speed.physics_step_s() < 0.1
