"""A run that fails is tried again only where its own account says that the machine did not keep time."""

from types import SimpleNamespace
from typing import Any

import pytest

from hardware_emulated.counted import against_the_clock
from standstill import MachineStoodStillError


def record(stale: int, latest_us: float) -> Any:
    timing = SimpleNamespace(stale_samples=(0, stale), cycles=1000, lateness_us={"max": latest_us})
    return SimpleNamespace(timing=timing)


@pytest.mark.parametrize(("stale", "latest_us"), [(20, 900.0), (0, 48_500.8)])
def test_a_machine_that_did_not_keep_time_is_named(stale: int, latest_us: float) -> None:
    with pytest.raises(MachineStoodStillError, match="unknown instants"), against_the_clock(record(stale, latest_us)):
        raise AssertionError("far off")


@pytest.mark.parametrize("told", [record(5, 900.0), SimpleNamespace(timing=None)])
def test_a_failure_on_one_that_did_has_failed(told: Any) -> None:
    with pytest.raises(AssertionError, match="far off"), against_the_clock(told):
        raise AssertionError("far off")


def test_what_holds_holds_on_any_machine() -> None:
    with against_the_clock(record(500, 1e6)):
        pass
