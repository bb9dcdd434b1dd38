"""Recorded velocities and accelerations are used where they are consistent and quieter, and nowhere else."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import signal

from recording.conditioning.synthetic import harmonics, record, robot
from tauscope.recording.conditioning import Conditioner, Source
from tauscope.recording.recording import Recording

MOTION = harmonics(joints=2, fundamental_hz=0.2, count=8)
RATE = 500.0
TIME = np.arange(15000) / RATE
Change = Callable[[np.ndarray], np.ndarray]


def noisy(velocity: np.ndarray | None, acceleration: np.ndarray | None = None, std: float = 2e-4) -> Recording:
    """Positions with noise beside some recorded rates."""
    noise = np.random.default_rng(3).normal(0.0, std, (len(TIME), 2))
    position = MOTION.derivative(TIME, 0) + noise
    return record(MOTION, TIME, position=position, velocity=velocity, acceleration=acceleration)


def white(std: float, seed: int = 7) -> np.ndarray:
    """Noise of its own."""
    return np.random.default_rng(seed).normal(0.0, std, (len(TIME), 2))


def sources(recording: Recording) -> list[str]:
    """What every joint's motion is made from."""
    return Conditioner.survey(recording, robot()).summary(5.0).velocity_source


def test_a_true_and_quiet_velocity_is_used_and_widens_the_band() -> None:
    plain = Conditioner.survey(noisy(None), robot())
    better = Conditioner.survey(noisy(MOTION.derivative(TIME, 1) + white(1e-4)), robot())
    assert better.summary(5.0).velocity_source == [Source.VELOCITY, Source.VELOCITY]
    assert plain.noise.limit_hz is not None
    assert better.noise.limit_hz is not None
    assert better.noise.limit_hz > 1.5 * plain.noise.limit_hz
    np.testing.assert_array_equal(better.noise.density, plain.noise.density)


def test_its_acceleration_is_closer_to_the_truth() -> None:
    errors = []
    for velocity in (None, MOTION.derivative(TIME, 1) + white(1e-4)):
        (motion,) = Conditioner.survey(noisy(velocity), robot()).motions(6.0)
        errors.append(np.sqrt(np.mean((motion.acceleration - MOTION.derivative(motion.time, 2)) ** 2)))
        np.testing.assert_allclose(motion.position, MOTION.derivative(motion.time, 0), atol=4e-4)
    assert errors[1] < 0.2 * errors[0]


def lagged(velocity: np.ndarray) -> np.ndarray:
    """A first-order filter of 50 Hz, as drives have."""
    return np.asarray(signal.lfilter([0.466], [1.0, -0.534], velocity, axis=0))


def colour_noise() -> np.ndarray:
    """Noise below 80 Hz alone: as loud in the band as the positions', all but silent where noise is looked for."""
    sections = signal.butter(4, 80.0, fs=RATE, output="sos")
    return np.asarray(signal.sosfiltfilt(sections, white(1e-2, seed=9), axis=0))


REFUSED: dict[str, Change] = {
    "gain of two percent": lambda v: 1.02 * v + white(1e-4),
    "wrong sign": lambda v: -v + white(1e-4),
    "one sample late": lambda v: np.roll(v, 1, axis=0) + white(1e-4),
    "half a sample early": lambda v: MOTION.derivative(TIME + 0.5 / RATE, 1) + white(1e-4),
    "filtered in the drive": lambda v: lagged(v) + white(1e-4),
    "offset": lambda v: v + 0.05 * np.abs(v).max() + white(1e-4),
    "noisier than the derivative": lambda v: v + white(2e-1),
    "degrees": lambda v: np.degrees(v) + white(1e-4),
    "made from the positions": lambda v: np.gradient(
        MOTION.derivative(TIME, 0) + white(2e-4, seed=3), 1 / RATE, axis=0
    ),
    "resonance that the positions do not show": lambda v: v + 0.02 * np.sin(2 * np.pi * 4.7 * TIME)[:, None],
    "vibration at the edge of the band": lambda v: v + 0.02 * np.sin(2 * np.pi * 20.0 * TIME)[:, None] + white(1e-4),
    "noise that was filtered": lambda v: v + colour_noise(),
    "constant": np.zeros_like,
}


@pytest.mark.parametrize("name", REFUSED)
def test_anything_else_is_refused(name: str) -> None:
    velocity = REFUSED[name](MOTION.derivative(TIME, 1))
    assert sources(noisy(velocity)) == [Source.POSITION, Source.POSITION]


def test_a_smoothed_derivative_of_the_positions_is_no_second_measurement() -> None:
    """Zero phase, unit gain, a very quiet plateau; and in its band the very noise of the positions."""
    position = MOTION.derivative(TIME, 0) + white(2e-4, seed=3)
    sections = signal.butter(4, 30.0, fs=RATE, output="sos")
    velocity = np.gradient(signal.sosfiltfilt(sections, position, axis=0), 1 / RATE, axis=0)
    assert sources(noisy(velocity)) == [Source.POSITION, Source.POSITION]
    assert sources(noisy(velocity + white(1e-4))) == [Source.POSITION, Source.POSITION]


def test_joints_are_judged_one_by_one() -> None:
    velocity = MOTION.derivative(TIME, 1) * np.array([1.0, 1.05]) + white(1e-4)
    conditioner = Conditioner.survey(noisy(velocity), robot())
    assert conditioner.summary(5.0).velocity_source == [Source.VELOCITY, Source.POSITION]
    plain = Conditioner.survey(noisy(None), robot())
    assert conditioner.noise.joint_limits_hz[0] > plain.noise.joint_limits_hz[0]
    assert conditioner.noise.joint_limits_hz[1] == plain.noise.joint_limits_hz[1]
    assert conditioner.noise.limit_hz == conditioner.noise.joint_limits_hz.min()


def test_a_quiet_acceleration_is_used_beside_or_without_a_velocity() -> None:
    acceleration = MOTION.derivative(TIME, 2) + white(1e-3, seed=8)
    both = noisy(MOTION.derivative(TIME, 1) + white(1e-2), acceleration)
    alone = noisy(None, acceleration)
    for recording in (both, alone):
        assert sources(recording) == [Source.ACCELERATION, Source.ACCELERATION]
        (motion,) = Conditioner.survey(recording, robot()).motions(6.0)
        np.testing.assert_allclose(motion.acceleration, MOTION.derivative(motion.time, 2), atol=4e-3)
    assert sources(noisy(None, 1.03 * acceleration)) == [Source.POSITION, Source.POSITION]


def test_missed_velocities_fall_back_for_their_stretch_alone() -> None:
    velocity = MOTION.derivative(TIME, 1) + white(1e-4)
    velocity[9000:9010, 0] = np.nan
    velocity[[500, 501, 700, 9500], 1] = np.nan  # single samples are bridged
    time = np.where(np.arange(len(TIME)) < 8000, TIME, TIME + 3.0)
    noise = np.random.default_rng(3).normal(0.0, 2e-4, (len(TIME), 2))
    recording = record(MOTION, time, position=MOTION.derivative(TIME, 0) + noise, velocity=velocity)
    conditioner = Conditioner.survey(recording, robot())
    assert conditioner.summary(5.0).velocity_source == [Source.VELOCITY, Source.VELOCITY]
    errors = []
    for motion, shift in zip(conditioner.motions(6.0), (0.0, 3.0), strict=True):
        assert np.isfinite(motion.velocity).all()
        error = motion.acceleration - MOTION.derivative(motion.time - shift, 2)
        errors.append(np.sqrt(np.mean(error**2, axis=0)))
    assert errors[1][0] > 4 * errors[0][0]
    assert errors[1][1] < 2 * errors[0][1]


def test_averaged_periods_use_them_too() -> None:
    motion = harmonics(joints=2, fundamental_hz=0.2, count=8)
    time = np.arange(12500) / RATE
    rng = np.random.default_rng(0)
    recording = record(
        motion,
        time,
        position=motion.derivative(time, 0) + rng.normal(0.0, 2e-4, (len(time), 2)),
        velocity=motion.derivative(time, 1) + rng.normal(0.0, 1e-4, (len(time), 2)),
        period=np.floor(time / 5.0 + 1e-9),
    )
    conditioner = Conditioner.survey(recording, robot())
    (averaged,) = conditioner.motions(8.0)
    assert averaged.repetitions == 5
    np.testing.assert_allclose(averaged.acceleration, motion.derivative(averaged.time, 2), atol=0.03)


def test_clean_positions_need_no_help() -> None:
    time = TIME
    recording = record(MOTION, time, velocity=MOTION.derivative(time, 1))
    assert sources(recording) == [Source.POSITION, Source.POSITION]


SLOW_RATE = 30.0
SLOW_TIME = np.arange(500) / SLOW_RATE


def slow(change: Change) -> Conditioner:
    """A short recording at 30 Hz, as of a robot's state topic: noisy positions, quieter velocities."""
    rng = np.random.default_rng(5)
    position = MOTION.derivative(SLOW_TIME, 0) + 2e-2 * rng.standard_normal((len(SLOW_TIME), 2))
    velocity = change(MOTION.derivative(SLOW_TIME, 1)) + 2e-1 * rng.standard_normal(position.shape)
    return Conditioner.survey(record(MOTION, SLOW_TIME, position=position, velocity=velocity), robot())


def test_at_a_low_rate_the_velocity_is_used_in_bands_in_which_it_is_quieter() -> None:
    conditioner = slow(lambda v: v)
    limit = conditioner.noise.limit_hz
    assert limit is not None
    assert conditioner.summary(0.5 * limit).velocity_source == [Source.POSITION, Source.POSITION]
    assert conditioner.summary(5.0).velocity_source == [Source.VELOCITY, Source.VELOCITY]
    assert conditioner.summary(None).velocity_source == [Source.VELOCITY, Source.VELOCITY]


@pytest.mark.parametrize(
    "change",
    [
        lambda v: 1.1 * v,
        lambda v: -v,
        lambda v: np.roll(v, 1, axis=0),
        lambda v: v + 0.1 * np.abs(v).max(),
    ],
    ids=["gain", "sign", "late", "offset"],
)
def test_at_a_low_rate_another_velocity_is_not(change: Change) -> None:
    assert slow(change).summary(5.0).velocity_source == [Source.POSITION, Source.POSITION]
