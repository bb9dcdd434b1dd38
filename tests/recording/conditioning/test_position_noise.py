"""Noise of the positions and the band that it allows."""

import numpy as np
import pytest
from scipy import signal

from recording.conditioning.synthetic import Harmonics, harmonics
from tauscope.recording.conditioning import Stretch
from tauscope.recording.conditioning.position_noise import NOISE_SHARE, encoder_step, position_noise, segment_spectra

MOTION = harmonics(joints=2, fundamental_hz=0.2)


def stretch_of(position: np.ndarray, rate: float) -> Stretch:
    """A stretch that has positions only."""
    still = np.zeros_like(position)
    return Stretch(0.0, rate, position, still, np.ones(position.shape, dtype=bool), None, False)


@pytest.mark.parametrize(("rate", "seconds"), [(1000.0, 20.0), (200.0, 30.0), (50.0, 60.0), (1000.0, 1.2)])
@pytest.mark.parametrize("std", [1e-5, 1e-3])
def test_the_density_of_white_noise_is_found(rate: float, seconds: float, std: float) -> None:
    time = np.arange(round(rate * seconds)) / rate
    ratios = []
    for seed in range(6):
        noise = np.random.default_rng(seed).normal(0.0, std, (len(time), 2))
        found = position_noise(stretch_of(MOTION.derivative(time, 0) + noise, rate))
        ratios.append(found.density / (std**2 * 2.0 / rate))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.05)
    assert np.abs(np.array(ratios) - 1.0).max() < (0.2 if seconds > 10.0 else 0.35)


@pytest.mark.parametrize("length", [256, 101])
def test_the_mean_of_segment_spectra_is_welchs(length: int) -> None:
    values = np.random.default_rng(4).normal(1.0, 2.0, (length + 10 * (length - length // 2), 3))
    spectra = segment_spectra(values, 200.0, length)
    frequency, expected = signal.welch(values, 200.0, nperseg=length, axis=0)
    assert spectra.shape[1:] == (len(frequency), 3)
    np.testing.assert_allclose(spectra.mean(axis=0), expected, rtol=1e-12)


@pytest.mark.parametrize("pieces", [[], [1050]])
def test_a_joint_that_moves_at_the_end_alone_sets_a_band(pieces: list[int]) -> None:
    time = np.arange(1400) / 100.0
    moved = np.where(time > 11.0, 0.3 * np.sin(4.0 * np.pi * np.maximum(time - 11.0, 0.0)), 0.0)
    noisy = moved[:, None] + np.random.default_rng(8).normal(0.0, 1e-5, (1400, 1))
    found = position_noise([stretch_of(piece, 100.0) for piece in np.split(noisy, pieces)])
    whole = position_noise(stretch_of(noisy[1100:], 100.0))
    assert found.joint_limits_hz[0] == pytest.approx(whole.joint_limits_hz[0], rel=0.3)


@pytest.mark.parametrize("counts", [4096, 65536])
def test_the_density_of_a_quantised_encoder_is_found(counts: int) -> None:
    step = 2.0 * np.pi / counts
    time = np.arange(20000) / 500.0
    stretch = stretch_of(np.round(MOTION.derivative(time, 0) / step) * step, 500.0)
    found = position_noise(stretch, encoder_step([stretch.position]))
    np.testing.assert_allclose(encoder_step([stretch.position]), step, rtol=1e-6)
    np.testing.assert_allclose(found.density, step**2 / 12.0 * 2.0 / 500.0, rtol=0.2)


def test_a_slow_joint_is_not_taken_to_be_cleaner_than_its_encoder() -> None:
    step, rate = 1e-3, 1000.0
    slow = 0.05 * np.sin(2 * np.pi * 0.05 * np.arange(40000) / rate)[:, None]
    stretch = stretch_of(np.round(slow / step) * step, rate)
    found = position_noise(stretch, encoder_step([stretch.position]))
    assert found.density[0] >= step**2 / (6.0 * rate) * (1.0 - 1e-9)


@pytest.mark.parametrize("values", [[3.0, 3.0, 3.0], [], [np.nan, 1.0], [1e6, 1e6 + 2e-10]])
def test_an_encoder_that_shows_no_step_has_none(values: list[float]) -> None:
    assert encoder_step([np.array(values)[:, None]]) == pytest.approx([0.0])


def test_the_band_narrows_with_the_noise_as_its_fifth_power_over_two() -> None:
    """Noise in q̈ grows as f⁵ S_n while the motion's is fixed: the limit goes as σ^(-2/5)."""
    rate, time = 1000.0, np.arange(30000) / 1000.0
    unit = np.random.default_rng(0).normal(size=(len(time), 2))
    std = np.array([3e-6, 3e-5, 3e-4])
    limits = [position_noise(stretch_of(MOTION.derivative(time, 0) + s * unit, rate)).joint_limits_hz for s in std]
    slope = np.polyfit(np.log(std), np.log(limits), 1)[0]
    np.testing.assert_allclose(slope, -0.4, atol=0.01)


def test_inside_the_limit_noise_keeps_to_its_share() -> None:
    rate, std = 1000.0, 2e-5
    time = np.arange(60000) / rate
    found = position_noise(
        stretch_of(MOTION.derivative(time, 0) + np.random.default_rng(0).normal(0.0, std, (len(time), 2)), rate)
    )
    motion = np.sqrt(np.mean(MOTION.derivative(time, 2) ** 2, axis=0))
    # Noise of one-sided density 2σ²/fs in q is (2π)⁴ 2σ²/fs f⁵/5 in q̈ below f.
    noise = (2 * np.pi) ** 2 * std * np.sqrt(2.0 / rate * found.joint_limits_hz**5 / 5.0)
    np.testing.assert_allclose(noise / motion, NOISE_SHARE, rtol=0.1)


def test_the_worst_moving_joint_sets_the_limit_of_all() -> None:
    rate, time = 500.0, np.arange(10000) / 500.0
    noise = np.random.default_rng(0).normal(size=(len(time), 3)) * np.array([1e-6, 1e-4, 1e-2])
    moving = np.hstack([MOTION.derivative(time, 0), np.zeros((len(time), 1))])
    found = position_noise(stretch_of(moving + noise, rate))
    assert found.limit_hz == found.joint_limits_hz.min() == found.joint_limits_hz[1]
    assert np.isinf(found.joint_limits_hz[2])  # it stands still, and shakes by its noise alone


@pytest.mark.parametrize("value", [0.0, 1.0, -1e5])
def test_constant_positions_set_no_limit(value: float) -> None:
    found = position_noise(stretch_of(np.full((400, 2), value), 100.0), np.zeros(2))
    assert found.limit_hz is None
    np.testing.assert_array_equal(found.density, 0.0)


def test_clean_positions_need_no_filter() -> None:
    time = np.arange(4000) / 200.0
    assert position_noise(stretch_of(MOTION.derivative(time, 0), 200.0)).limit_hz is None


@pytest.mark.parametrize("count", [32, 50, 200])
def test_tiny_stretches_have_a_finite_answer(count: int) -> None:
    rng = np.random.default_rng(0)
    found = position_noise(stretch_of(rng.normal(size=(count, 1)).cumsum(axis=0), 100.0))
    assert np.isfinite(found.density).all()


def test_several_stretches_are_averaged() -> None:
    rate, rng = 200.0, np.random.default_rng(0)
    still = [stretch_of(rng.normal(0.0, 1e-5, (4000, 2)), rate) for _ in range(2)]
    time = np.arange(4000) / rate
    moving = stretch_of(MOTION.derivative(time, 0) + rng.normal(0.0, 1e-5, (4000, 2)), rate)
    assert position_noise(still).limit_hz is None
    limit = position_noise([*still, moving]).limit_hz
    assert limit is not None
    assert limit == pytest.approx(position_noise(moving).limit_hz, rel=0.35)


def test_a_single_lively_joint_alone() -> None:
    one = Harmonics(np.array([0.5]), np.array([[0.5]]), np.array([[0.0]]), np.array([0.0]))
    time = np.arange(5000) / 100.0
    noise = np.random.default_rng(1).normal(0.0, 1e-3, (5000, 1))
    limit = position_noise(stretch_of(one.derivative(time, 0) + noise, 100.0)).limit_hz
    assert limit is not None
    assert 0.5 < limit < 10.0


def test_a_joint_that_shakes_for_a_while_is_not_taken_to_be_noisy() -> None:
    """Two seconds of shaking in twelve, thirty times the noise, as a joint has that sticks and slips."""
    rate, std = 200.0, 2e-5
    time = np.arange(2400) / rate
    random = np.random.default_rng(3)
    calm = MOTION.derivative(time, 0) + random.normal(0.0, std, (len(time), 2))
    shaking = calm + (30.0 * random.normal(0.0, std, (len(time), 2))) * ((time > 5.0) & (time < 7.0))[:, None]
    found = position_noise(stretch_of(shaking, rate))
    np.testing.assert_allclose(found.density, std**2 * 2.0 / rate, rtol=0.2)


def test_a_joint_that_rests_half_the_time_is_not_taken_to_be_as_quiet_as_at_rest() -> None:
    rate, std = 200.0, 2e-5
    time = np.arange(2400) / rate
    moving = (time < 6.0)[:, None]
    position = np.where(moving, MOTION.derivative(time, 0), MOTION.derivative(np.array([6.0]), 0))
    noise = np.random.default_rng(3).normal(0.0, std, (len(time), 2)) * np.where(moving, 1.0, 0.05)
    found = position_noise(stretch_of(position + noise, rate))
    assert (found.density > 0.3 * std**2 * 2.0 / rate).all()
