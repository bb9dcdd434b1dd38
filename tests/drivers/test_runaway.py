"""Limits that a driver keeps where drives are given torque: by closed form, one joint at a time."""

import numpy as np
import pytest

from tauscope_drivers import DriveLimits
from tauscope_drivers.limits import CATCH_S, PERSISTENCE, SPEED_MARGIN, RunawayWatch

LIMITS = DriveLimits(np.full(2, -1.0), np.full(2, 1.0), np.full(2, 2.0), np.full(2, 5.0))


@pytest.fixture
def watch() -> RunawayWatch:
    return RunawayWatch(LIMITS)


def look(watch: RunawayWatch, position: float, velocity: float):
    """Joint 2 moves, joint 1 rests."""
    return watch.look(np.array([0.0, position]), np.array([0.0, velocity]))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_is_caught_where_it_would_be_beyond_its_limit_by_then(watch: RunawayWatch, side: float) -> None:
    speed = 1.5
    edge = 1.0 - CATCH_S * speed
    assert look(watch, side * (edge - 1e-6), side * speed) is None
    fault = look(watch, side * (edge + 1e-6), side * speed)
    assert fault is not None
    assert (fault.code, fault.joint) == ("position-limit", 2)
    assert "acknowledge" in fault.remedy


def test_a_joint_that_comes_back_into_its_range_is_left_alone(watch: RunawayWatch) -> None:
    assert look(watch, 1.2, -0.5) is None
    assert look(watch, -1.2, 0.5) is None
    fault = look(watch, 1.2, 0.0)
    assert fault is not None
    assert fault.code == "position-limit"


def test_a_speed_counts_when_it_lasts(watch: RunawayWatch) -> None:
    fast = 2.0 * SPEED_MARGIN + 1e-6
    for _ in range(PERSISTENCE - 1):
        assert look(watch, 0.0, fast) is None
    assert look(watch, 0.0, 0.0) is None, "one noisy reading"
    for _ in range(PERSISTENCE - 1):
        assert look(watch, 0.0, -fast) is None
    fault = look(watch, 0.0, -fast)
    assert fault is not None
    assert (fault.code, fault.joint) == ("over-speed", 2)


def test_a_sample_that_was_missed_is_no_reason(watch: RunawayWatch) -> None:
    for _ in range(2 * PERSISTENCE):
        assert look(watch, np.nan, np.nan) is None
        assert look(watch, np.nan, 0.0) is None
