"""A test against the clock is run again only where the machine stood still under it."""

import pytest

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


@pytest.mark.parametrize(("microseconds", "outcome"), [(100_000, {"passed": 1, "rerun": 1}), (0, {"failed": 1})])
def test_a_failure_counts_unless_the_machine_stood_still(
    pytester: pytest.Pytester, microseconds: int, outcome: dict[str, int]
) -> None:
    pytester.makeini("[pytest]\nmarkers = realtime\n")
    pytester.makepyfile(FAILS_AT_FIRST.format(microseconds=microseconds))
    result = pytester.runpytest("-p", "standstill", "--reruns", "1", "--only-rerun", "MachineStoodStill")
    assert result.parseoutcomes() == outcome
