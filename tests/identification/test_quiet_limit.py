"""The band in which positions of all recordings together are quiet."""

import numpy as np
import pytest
from numpy.typing import NDArray

from recording.conditioning.synthetic import Harmonics, harmonics, record, robot
from tauscope.identification.band import quiet_limit
from tauscope.recording.conditioning import Conditioner

RATE = 200.0
STD = 1e-5
LIVELY = harmonics(joints=2, fundamental_hz=0.2)


def surveyed(motion: Harmonics, seconds: float, seed: int) -> Conditioner:
    """A recording of the motion with white noise in its positions."""
    time = np.arange(round(seconds * RATE)) / RATE
    noise = np.random.default_rng(seed).normal(0.0, STD, (len(time), 2))
    return Conditioner.survey(record(motion, time, position=motion.derivative(time, 0) + noise), robot())


def slowed(motion: Harmonics, factor: float) -> Harmonics:
    return Harmonics(motion.frequency_hz / factor, motion.amplitude, motion.phase, motion.centre)


def limits(*conditioners: Conditioner) -> NDArray[np.float64]:
    return np.array([each.noise.joint_limits_hz for each in conditioners])


def test_one_recording_sets_its_own_limit() -> None:
    one = surveyed(LIVELY, 40.0, 0)
    assert quiet_limit([one]) == pytest.approx(one.noise.limit_hz, rel=1e-12)


def test_a_recording_twice_says_what_it_says_once() -> None:
    one = surveyed(LIVELY, 40.0, 0)
    assert quiet_limit([one, one, one]) == pytest.approx(one.noise.limit_hz, rel=1e-12)


def test_slow_reversals_take_little_of_the_band() -> None:
    lively, slow = surveyed(LIVELY, 40.0, 0), surveyed(slowed(LIVELY, 10.0), 40.0, 1)
    own = limits(lively, slow)
    assert own[1].max() < 0.5 * own[0].min(), "alone, the slow recording would narrow the band"
    # noise twice as long, and as good as no motion more: half the ratio, which grows as f⁵
    expected = (own[0] * 0.5**0.2).min()
    assert quiet_limit([lively, slow]) == pytest.approx(expected, rel=0.03)


def test_a_joint_that_only_one_recording_moves_stands_what_that_allows() -> None:
    one_joint = Harmonics(LIVELY.frequency_hz, LIVELY.amplitude * [[1.0], [0.0]], LIVELY.phase, LIVELY.centre)
    both, first = surveyed(LIVELY, 40.0, 0), surveyed(one_joint, 40.0, 1)
    found = quiet_limit([both, first])
    assert found == pytest.approx(min(limits(both)[0, 1] * 0.5**0.2, limits(both, first)[:, 0].min()), rel=0.03)


def test_positions_without_noise_set_none() -> None:
    time = np.arange(8000) / RATE
    exact = Conditioner.survey(record(LIVELY, time), robot())
    assert quiet_limit([exact]) is None
