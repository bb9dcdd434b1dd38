"""Trajectories: pieces that join smoothly, samples, period labels, ramps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation.excited_arms import limited_paper_arm, resting_series
from tauscope.errors import ExcitationError
from tauscope.trajectory import FourierSegment, MotionLimits, MotionSamples, SampledSegment, Trajectory, motion_limits
from tauscope.trajectory.segments import MoveSegment, PathSegment, minimum_jerk
from tauscope.trajectory.trajectory import ramp

LIMITS = motion_limits(limited_paper_arm())
NAMES = ("joint1", "joint2", "joint3")


def whole_trajectory(seed: int = 0) -> Trajectory:
    """One piece of every kind."""
    series = resting_series(np.random.default_rng(seed), 3)
    start = series.evaluate(np.zeros(1)).position[0]
    place = series.evaluate(np.array([3.7])).position[0]
    move = ramp(place, start, LIMITS)
    segments = (
        FourierSegment(series, 2, first_period=0),
        PathSegment(series, 0.0, 3.7, 9.0),
        move,
        FourierSegment(series, 1, first_period=2),
    )
    return Trajectory("paper", NAMES, segments)


def test_the_motion_is_twice_continuously_differentiable() -> None:
    trajectory = whole_trajectory()
    rate = 2000.0
    samples = trajectory.samples(rate)
    jerk = np.abs(np.diff(samples.acceleration, axis=0)).max() * rate
    # Within pieces the acceleration changes at the rate of the jerk; a jump at a joint would be as large as q̈ itself.
    assert jerk < 40.0
    for order, (values, derivative) in enumerate(
        ((samples.position, samples.velocity), (samples.velocity, samples.acceleration))
    ):
        found = (values[2:] - values[:-2]) * rate / 2.0
        assert np.abs(found - derivative[1:-1]).max() < (1e-5, 5e-3)[order]


def test_every_piece_begins_and_ends_at_rest() -> None:
    for segment in whole_trajectory().segments:
        ends = segment.evaluate(np.array([0.0, segment.duration_s]))
        assert np.abs(ends.velocity).max() < 1e-12
        assert np.abs(ends.acceleration).max() < 1e-11


def test_period_labels_count_whole_periods() -> None:
    samples = whole_trajectory().samples(100.0)
    for label in (0, 1, 2):
        assert np.count_nonzero(samples.period == label) == 1000
    assert np.isnan(samples.period[-1])
    first, second = (samples.position[samples.period == label] for label in (0, 1))
    np.testing.assert_allclose(first, second, atol=1e-12)
    assert set(np.unique(samples.period[np.isfinite(samples.period)])) == {0.0, 1.0, 2.0}


def test_samples_end_where_the_motion_ends() -> None:
    trajectory = whole_trajectory()
    samples = trajectory.samples(7.3)
    assert trajectory.duration_s <= samples.time[-1] < trajectory.duration_s + 1.0 / 7.3
    np.testing.assert_allclose(samples.position[-1], trajectory.end, atol=1e-12)
    assert np.abs(samples.velocity[-1]).max() < 1e-9


def test_it_stands_still_before_and_after() -> None:
    trajectory = whole_trajectory()
    outside = trajectory.evaluate(np.array([-1.0, trajectory.duration_s + 1.0]))
    np.testing.assert_allclose(outside.position, [trajectory.start, trajectory.end], atol=1e-12)
    assert not outside.velocity.any()
    assert not outside.acceleration.any()
    assert np.isnan(outside.period).all()


def test_a_path_visits_the_series_postures_at_its_own_pace() -> None:
    series = resting_series(np.random.default_rng(1), 3)
    segment = PathSegment(series, 2.0, 6.0, 11.0)
    time = np.linspace(0.0, 11.0, 57)
    progress, _, _ = minimum_jerk(time, 11.0)
    np.testing.assert_allclose(
        segment.evaluate(time).position, series.evaluate(2.0 + 4.0 * progress).position, atol=1e-12
    )
    step = 1e-5
    motion = segment.evaluate(time[1:-1])
    before, after = (segment.evaluate(time[1:-1] + sign * step) for sign in (-1, 1))
    np.testing.assert_allclose(motion.velocity, (after.position - before.position) / (2 * step), atol=1e-8)
    np.testing.assert_allclose(motion.acceleration, (after.velocity - before.velocity) / (2 * step), atol=1e-8)


posture = st.lists(st.floats(-2.9, 2.9), min_size=3, max_size=3).map(np.array)


@given(start=posture, end=posture, speed=st.floats(0.05, 5.0), acceleration=st.floats(0.1, 30.0))
def test_ramps_keep_half_the_limits_and_stay_between_their_ends(
    start: np.ndarray, end: np.ndarray, speed: float, acceleration: float
) -> None:
    three = np.ones(3)
    limits = MotionLimits(-2.9 * three, 2.9 * three, speed * three, acceleration * three, np.inf * three)
    way = ramp(start, end, limits)
    motion = way.evaluate(np.linspace(0.0, way.duration_s, 501))
    assert np.abs(motion.velocity).max() <= 0.5 * speed * (1.0 + 1e-9)
    assert np.abs(motion.acceleration).max() <= 0.5 * acceleration * (1.0 + 1e-9)
    low, high = np.minimum(start, end), np.maximum(start, end)
    assert (motion.position >= low - 1e-12).all()
    assert (motion.position <= high + 1e-12).all()
    assert np.array_equal(motion.position[0], start)
    assert np.array_equal(motion.position[-1], end)


def test_a_ramp_goes_before_the_trajectory() -> None:
    trajectory = whole_trajectory()
    standing = np.array([1.0, -1.0, 0.3])
    whole = replace(trajectory, segments=(ramp(standing, trajectory.start, LIMITS), *trajectory.segments))
    assert np.array_equal(whole.start, standing)
    np.testing.assert_allclose(whole.end, trajectory.end)
    assert whole.duration_s > trajectory.duration_s
    with pytest.raises(ExcitationError, match="3 joints"):
        ramp(np.array([1.0, np.nan, 0.3]), trajectory.start, LIMITS)


def test_sampled_motion_meets_its_samples_and_is_smooth_between() -> None:
    series = resting_series(np.random.default_rng(2), 2)
    time = np.linspace(0.0, 10.0, 201)
    segment = SampledSegment(time, series.evaluate(time))
    between = np.linspace(0.0, 10.0, 2333)
    for name, tolerance in (("position", 1e-9), ("velocity", 2e-7), ("acceleration", 2e-5)):
        exact, found = (getattr(each.evaluate(between), name) for each in (series, segment))
        np.testing.assert_allclose(found, exact, atol=tolerance)
        np.testing.assert_allclose(
            getattr(segment.evaluate(time), name), getattr(series.evaluate(time), name), atol=1e-12
        )


def test_pieces_that_do_not_meet_are_refused() -> None:
    move = MoveSegment(np.zeros(3), np.ones(3), 2.0)
    with pytest.raises(ExcitationError, match=r"segments\[1\], joint1: begins 1 away"):
        Trajectory("arm", NAMES, (move, move))
    moving = resting_series(np.random.default_rng(3), 3)
    moving.cosine[1, 0] += 0.5
    with pytest.raises(ExcitationError, match=r"segments\[0\], joint2: velocity is 0\.5 1/s at its start"):
        Trajectory("arm", NAMES, (FourierSegment(moving),))
    with pytest.raises(ExcitationError, match="moves 3 joints, the trajectory names 2"):
        Trajectory("arm", NAMES[:2], (move,))
    with pytest.raises(ExcitationError, match="at least one segment"):
        Trajectory("arm", NAMES, ())
    still = MotionSamples(np.zeros((2, 3)), np.full((2, 3), 0.1), np.zeros((2, 3)))
    with pytest.raises(ExcitationError, match="rest"):
        Trajectory("arm", NAMES, (SampledSegment(np.array([0.0, 1.0]), still),))


@pytest.mark.parametrize("rate", [0.0, -5.0, np.nan, np.inf, 1e12])
def test_rates_that_make_no_sense(rate: float) -> None:
    with pytest.raises(ExcitationError):
        whole_trajectory().samples(rate)
