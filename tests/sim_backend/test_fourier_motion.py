"""Random Fourier motions stay within the limits, rest at their ends, and are their own derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.errors import RecordingError, RobotFileError
from tauscope.robot.robot import Joint, JointLimits
from tauscope_sim.motion import FourierMotion, random_fourier_motion

JOINTS = (
    Joint("base", limits=JointLimits(position=(-2.9, 2.9), velocity=2.0, acceleration=5.0)),
    Joint("narrow", limits=JointLimits(position=(1.0, 1.2), velocity=2.0, acceleration=5.0)),
    Joint("slow", limits=JointLimits(position=(-10.0, 10.0), velocity=0.1)),
    Joint("endless", limits=JointLimits(acceleration=0.5)),
)


def motion_of(seed: int, period_s: float = 10.0, harmonics: int = 5, limit_fraction: float = 0.95) -> FourierMotion:
    rng = np.random.default_rng(seed)
    return random_fourier_motion(JOINTS, rng, period_s=period_s, harmonics=harmonics, limit_fraction=limit_fraction)


@given(seed=st.integers(0, 2**32), period_s=st.floats(0.5, 60.0), harmonics=st.integers(2, 12))
def test_limits_hold_and_one_of_them_is_used(seed: int, period_s: float, harmonics: int) -> None:
    motion = motion_of(seed, period_s, harmonics, limit_fraction=1.0)
    samples = motion.evaluate(np.linspace(0.0, period_s, 20_001))
    for column, joint in enumerate(JOINTS):
        used: list[float] = []
        if joint.limits.position is not None:
            low, high = joint.limits.position
            position = samples.position[:, column]
            assert position.min() >= low - 1e-12
            assert position.max() <= high + 1e-12
            used.append(float(np.ptp(position)) / (high - low))
        if joint.limits.velocity is not None:
            used.append(float(np.abs(samples.velocity[:, column]).max()) / joint.limits.velocity)
        if joint.limits.acceleration is not None:
            used.append(float(np.abs(samples.acceleration[:, column]).max()) / joint.limits.acceleration)
        assert 0.99 < max(used) <= 1.0 + 1e-12


@given(seed=st.integers(0, 2**32), period_s=st.floats(0.5, 60.0), harmonics=st.integers(2, 12))
def test_motion_rests_at_both_ends_and_repeats(seed: int, period_s: float, harmonics: int) -> None:
    ends = motion_of(seed, period_s, harmonics).evaluate(np.array([0.0, period_s]))
    np.testing.assert_allclose(ends.velocity, 0.0, atol=1e-12)
    np.testing.assert_allclose(ends.acceleration, 0.0, atol=1e-11)
    np.testing.assert_allclose(ends.position[0], ends.position[1], atol=1e-12)


def test_derivatives_are_those_of_the_position() -> None:
    motion, step = motion_of(3), 1e-4
    time = np.linspace(0.0, 10.0, 101)
    now, earlier, later = (motion.evaluate(time + shift) for shift in (0.0, -step, step))
    np.testing.assert_allclose((later.position - earlier.position) / (2 * step), now.velocity, atol=1e-6)
    np.testing.assert_allclose((later.velocity - earlier.velocity) / (2 * step), now.acceleration, atol=1e-6)


def test_no_power_above_the_last_harmonic() -> None:
    samples = motion_of(5).evaluate(np.arange(1000) / 100.0)
    spectrum = np.abs(np.fft.rfft(samples.acceleration, axis=0))
    assert spectrum[6:].max() < 1e-12 * spectrum.max()
    assert np.all(spectrum[1:6].max(axis=0) > 0.0)


def test_the_same_seed_gives_the_same_motion_and_another_does_not() -> None:
    first, again, other = motion_of(1), motion_of(1), motion_of(2)
    np.testing.assert_array_equal(first.cosine, again.cosine)
    np.testing.assert_array_equal(first.centre, again.centre)
    assert not np.any(first.cosine == other.cosine)


def test_motions_that_leave_room_are_spread_over_it() -> None:
    """The slow joint uses a fraction of its ±10 rad: gravity is seen at other angles with another seed."""
    middles = [motion_of(seed).evaluate(np.linspace(0.0, 10.0, 500)).position[:, 2].mean() for seed in range(40)]
    assert min(middles) < -5.0
    assert max(middles) > 5.0
    assert np.abs(middles).max() < 9.5


def test_limit_fraction_keeps_a_margin() -> None:
    samples = motion_of(1, limit_fraction=0.5).evaluate(np.linspace(0.0, 10.0, 5001))
    assert 1.05 - 1e-12 <= samples.position[:, 1].min() < samples.position[:, 1].max() <= 1.15 + 1e-12
    assert 0.049 < np.abs(samples.velocity[:, 2]).max() <= 0.05


def test_a_joint_without_limits_is_named() -> None:
    with pytest.raises(RobotFileError, match="joint free: limits states neither"):
        random_fourier_motion([Joint("free")], np.random.default_rng(0))


@pytest.mark.parametrize(
    ("period_s", "harmonics", "limit_fraction", "named"),
    [(0.0, 5, 0.9, "period_s"), (np.inf, 5, 0.9, "period_s"), (10.0, 1, 0.9, "harmonics"), (10.0, 5, 1.1, "limit_fr")],
)
def test_impossible_settings_are_named(period_s: float, harmonics: int, limit_fraction: float, named: str) -> None:
    with pytest.raises(RecordingError, match=named):
        motion_of(0, period_s, harmonics, limit_fraction)
