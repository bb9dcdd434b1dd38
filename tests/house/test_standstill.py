"""A test against the clock is run again only where the machine stood still under it."""

from typing import Any

import pytest

import machine_speed

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


def outcomes(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, microseconds: int, step_s: float) -> Any:
    monkeypatch.setattr(machine_speed, "physics_step_s", lambda: step_s)
    pytester.makeini("[pytest]\nmarkers = realtime\n")
    pytester.makepyfile(FAILS_AT_FIRST.format(microseconds=microseconds))
    result = pytester.runpytest_inprocess("-p", "standstill", "--reruns", "1", "--only-rerun", "MachineStoodStill")
    return result.parseoutcomes()


@pytest.mark.parametrize(("microseconds", "outcome"), [(100_000, {"passed": 1, "rerun": 1}), (0, {"failed": 1})])
def test_a_failure_counts_unless_the_machine_stood_still(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, microseconds: int, outcome: dict[str, int]
) -> None:
    assert outcomes(pytester, monkeypatch, microseconds, machine_speed.QUICK_ENOUGH_S) == outcome


@pytest.mark.parametrize("microseconds", [100_000, 0])
def test_a_failure_is_expected_of_a_machine_that_is_too_slow(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, microseconds: int
) -> None:
    assert outcomes(pytester, monkeypatch, microseconds, 1.01 * machine_speed.QUICK_ENOUGH_S) == {"xfailed": 1}


def test_the_machine_s_speed_is_that_of_the_physics() -> None:
    assert 1e-6 < machine_speed.physics_step_s() < 0.1
