"""Targets that drives in cyclic synchronous position mode are sent."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tauscope_drivers import DriveLimits, Setpoint
from tauscope_drivers.canopen.target_limiter import TargetLimiter
from tauscope_drivers.limits import SPEED_MARGIN

LOW, HIGH, SPEED, TORQUE = -1.0, 1.5, 0.8, 20.0
BOUNDS = DriveLimits(*(np.full(2, value) for value in (LOW, HIGH, SPEED, TORQUE)))
CYCLE_NS = 5_000_000
CYCLE_S = 1e-9 * CYCLE_NS


def setpoint(position: float, torque: float = 0.0) -> Setpoint:
    return Setpoint(np.full(2, position), np.full(2, torque))


def sent_towards(target: float, instants_ns: Sequence[int]) -> np.ndarray:
    limiter = TargetLimiter(BOUNDS, np.zeros(2), CYCLE_S)
    return np.array([limiter.limited(setpoint(target), now_ns).position[0] for now_ns in instants_ns])


def test_targets_within_the_limits_are_passed_on_exactly() -> None:
    limiter = TargetLimiter(BOUNDS, np.zeros(2), CYCLE_S)
    for cycle in range(400):
        wanted = 0.4 * (1.0 - np.cos(1.5 * cycle * CYCLE_S))
        np.testing.assert_array_equal(limiter.limited(setpoint(wanted), cycle * CYCLE_NS).position, wanted)


def test_a_leap_is_approached_at_the_speed_limit_and_not_overrun() -> None:
    sent = sent_towards(1.0, range(0, 400 * CYCLE_NS, CYCLE_NS))
    speed = np.diff(sent, prepend=0.0) / CYCLE_S
    assert speed.max() <= SPEED * (1.0 + 1e-9)
    assert speed.max() > 0.95 * SPEED
    # also from rest, however long ago the arm was enabled
    assert np.abs(np.diff(speed, prepend=0.0)).max() < 2.0 * SPEED * CYCLE_S / 0.1
    assert sent.max() <= 1.0
    assert sent[-1] == pytest.approx(1.0, abs=1e-9)


def interpolated_speed(sent: np.ndarray, instants_ns: np.ndarray) -> np.ndarray:
    """Speed of a drive that goes from where it is to every target within the cycle that it was told, in a line."""
    place, speeds = 0.0, []
    for target, until_ns in zip(sent, np.diff(instants_ns, append=instants_ns[-1] + CYCLE_NS), strict=True):
        speeds.append((target - place) / CYCLE_S)
        place += min(1.0, until_ns / CYCLE_NS) * (target - place)
    return np.abs(speeds)


LATENESS_NS = arrays(np.int64, 100, elements=st.integers(0, int(0.85 * CYCLE_NS)))


@given(LATENESS_NS)
def test_a_target_that_comes_late_goes_no_further_than_one_in_time(late_ns: np.ndarray) -> None:
    """A drive interpolates over the cycle that it was told: the steps have to be those of whole cycles."""
    late_ns[0] = 0
    in_time = np.arange(100) * CYCLE_NS
    late, expected = (sent_towards(1.0, instants.tolist()) for instants in (in_time + late_ns, in_time))
    assert np.all(late <= expected + 1e-12)
    assert np.all(np.diff(late) >= 0.0)


@given(LATENESS_NS)
def test_a_drive_goes_no_faster_where_the_next_target_follows_soon_upon_a_late_one(late_ns: np.ndarray) -> None:
    late_ns[0] = 0
    instants = np.arange(100) * CYCLE_NS + late_ns
    assert interpolated_speed(sent_towards(1.0, instants.tolist()), instants).max() <= SPEED * (1.0 + 1e-6)


@given(LATENESS_NS)
def test_nor_does_it_on_a_motion_near_the_limit(late_ns: np.ndarray) -> None:
    """At speeds up to 0.95 of the limit, which one late target and the next would make 1.8 of it."""
    late_ns[0] = 0
    cycles = np.arange(100)
    plan = 0.95 * SPEED * CYCLE_S * (cycles - 20.0 * (1.0 - np.exp(-cycles / 20.0)))
    limiter, instants = TargetLimiter(BOUNDS, np.zeros(2), CYCLE_S), cycles * CYCLE_NS + late_ns
    sent = [limiter.limited(setpoint(q), now).position[0] for q, now in zip(plan, instants.tolist(), strict=True)]
    assert interpolated_speed(np.array(sent), instants).max() <= 1.4 * SPEED_MARGIN * SPEED * (1.0 + 1e-6)
    assert np.all(sent <= plan + 1e-12)


def test_no_cycle_makes_up_for_those_that_a_late_host_skipped() -> None:
    """A drive goes to its target within one cycle, also where the host has let three pass."""
    cycles = np.delete(np.arange(400), [60, 61, 62, 150, 151])
    limiter = TargetLimiter(BOUNDS, np.zeros(2), CYCLE_S)
    plan = 0.5 * (1.0 - np.cos(1.5 * cycles * CYCLE_S))  # 0.75 rad/s at most, just below the limit
    sent = np.array(
        [limiter.limited(setpoint(q), int(k) * CYCLE_NS).position[0] for k, q in zip(cycles, plan, strict=True)]
    )
    speed = np.diff(sent) / CYCLE_S
    assert np.abs(speed).max() <= SPEED * (1.0 + 1e-9)
    assert np.abs(np.diff(speed)).max() < 0.2 * SPEED, "three cycles in one would be twice the speed more"
    # it catches up while the target goes on moving
    np.testing.assert_allclose(sent[100:147], plan[100:147], atol=1e-12)
    np.testing.assert_allclose(sent[-100:], plan[-100:], atol=1e-12)


def test_after_a_stall_a_burst_of_targets_keeps_to_the_speed_limit() -> None:
    instants = [*range(0, 60 * CYCLE_NS, CYCLE_NS), *(66 * CYCLE_NS + 100_000 * k for k in range(6))]
    sent = sent_towards(1.0, instants)
    assert sent[-1] - sent[59] <= SPEED * CYCLE_S * (1.0 + 1e-9)


@given(arrays(np.float64, (30, 2), elements=st.floats(-1e6, 1e6)), st.floats(-1e6, 1e6))
def test_whatever_is_asked_for_stays_within_range_speed_and_torque(asked: np.ndarray, torque: float) -> None:
    limiter, before = TargetLimiter(BOUNDS, np.zeros(2), CYCLE_S), np.zeros(2)
    for cycle, row in enumerate(asked):
        sent = limiter.limited(Setpoint(row, np.full(2, torque)), cycle * CYCLE_NS)
        assert ((sent.position >= LOW) & (sent.position <= HIGH)).all()
        assert (np.abs(sent.torque) <= TORQUE).all()
        assert (np.abs(sent.position - before) <= SPEED_MARGIN * SPEED * 1.4 * CYCLE_S + 1e-12).all()
        before = sent.position
