"""Limits that a driver keeps for its drives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drivers import DriveLimits, DriverError, Setpoint, limits
from drivers.limits import SPEED_MARGIN, RunawayWatch, TargetLimiter, require_sensible

LOW, HIGH, SPEED, TORQUE = -1.0, 1.5, 0.8, 20.0
BOUNDS = DriveLimits(*(np.full(2, value) for value in (LOW, HIGH, SPEED, TORQUE)))
CYCLE_NS = 5_000_000


class Clock:
    """Time that passes only when it is told to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns = 0
        monkeypatch.setattr(limits.time, "monotonic_ns", lambda: self.now_ns)

    def cycle(self) -> None:
        self.now_ns += CYCLE_NS


def setpoint(position: float, torque: float = 0.0) -> Setpoint:
    return Setpoint(np.full(2, position), np.full(2, torque))


def test_targets_within_the_limits_are_passed_on_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    limiter = TargetLimiter(BOUNDS, np.zeros(2))
    for cycle in range(400):
        clock.cycle()
        wanted = 0.4 * (1.0 - np.cos(1.5 * cycle * CYCLE_NS * 1e-9))
        np.testing.assert_array_equal(limiter.limited(setpoint(wanted)).position, wanted)


def test_a_leap_is_approached_at_the_speed_limit_and_not_overrun(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    limiter = TargetLimiter(BOUNDS, np.zeros(2))
    sent = []
    for _ in range(400):
        clock.cycle()
        sent.append(limiter.limited(setpoint(1.0)).position[0])
    speed = np.diff(sent) / (CYCLE_NS * 1e-9)
    assert speed.max() <= SPEED * (1.0 + 1e-9)
    assert speed.max() > 0.95 * SPEED
    assert np.abs(np.diff(speed)).max() < 2.0 * SPEED * CYCLE_NS * 1e-9 / 0.1
    assert max(sent) <= 1.0
    assert sent[-1] == pytest.approx(1.0, abs=1e-9)


@given(arrays(np.float64, (30, 2), elements=st.floats(-1e6, 1e6)), st.floats(-1e6, 1e6))
def test_whatever_is_asked_for_stays_within_range_speed_and_torque(asked: np.ndarray, torque: float) -> None:
    with pytest.MonkeyPatch.context() as patch:
        clock = Clock(patch)
        limiter, before = TargetLimiter(BOUNDS, np.zeros(2)), np.zeros(2)
        for row in asked:
            clock.cycle()
            sent = limiter.limited(Setpoint(row, np.full(2, torque)))
            assert ((sent.position >= LOW) & (sent.position <= HIGH)).all()
            assert (np.abs(sent.torque) <= TORQUE).all()
            assert (np.abs(sent.position - before) <= SPEED_MARGIN * SPEED * 0.007 + 1e-12).all()
            before = sent.position


def test_a_runaway_is_seen_before_the_limit_and_not_where_it_comes_back() -> None:
    watch = RunawayWatch(BOUNDS)
    assert watch.look(np.array([1.4, 0.0]), np.array([0.5, 0.0])) is None
    fault = watch.look(np.array([1.4, 0.0]), np.array([2.5, 0.0]))
    assert fault is not None
    assert (fault.code, fault.joint) == ("position-limit", 1)
    assert watch.look(np.array([1.6, 0.0]), np.array([-0.5, 0.0])) is None, "it is on its way back"
    assert watch.look(np.full(2, np.nan), np.full(2, np.nan)) is None


def test_one_noisy_reading_is_no_runaway() -> None:
    watch = RunawayWatch(BOUNDS)
    assert watch.look(np.zeros(2), np.array([0.0, 1.0])) is None
    fault = watch.look(np.zeros(2), np.array([0.0, 1.0]))
    assert fault is not None
    assert (fault.code, fault.joint) == ("over-speed", 2)


def test_an_arm_outside_its_range_is_not_enabled() -> None:
    with pytest.raises(DriverError, match=r"joint 2 stands at 1\.7"):
        require_sensible(BOUNDS, np.array([0.0, 1.7]))
    require_sensible(BOUNDS, np.array([0.0, 1.54]))
