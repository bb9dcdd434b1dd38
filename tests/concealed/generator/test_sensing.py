"""What poor sensors make of a known motion: each flaw alone, against what its words say."""

from dataclasses import replace

import numpy as np
import pytest

from concealed.generator.forward import Passage
from concealed.generator.rates import FINE, RATE_HZ
from concealed.generator.sensing import BUNCH, BUNCHED_S, Noise, recording
from concealed.generator.stepwise import Stepwise
from tauscope.recording import Recording

COUNT = 8000
QUIET = Noise((1e-9, 1e-9), position_std=0.0)


def record(noise: Noise, every: int = 1) -> Recording:
    time = np.arange(FINE * COUNT) / (FINE * RATE_HZ)
    position = np.column_stack([np.sin(time), 0.5 * np.cos(0.7 * time)])
    passage = Passage(position, np.gradient(position, time, axis=0), np.column_stack([3.0 + time, 2.0 + np.sin(time)]))
    motion = Stepwise("known", position[::FINE])
    return recording(motion, passage, [], noise, np.random.default_rng(5), every=every)


def test_twelve_bit_without_dither_stand_still_between_counts() -> None:
    step = 2.0 * np.pi / 4096
    position = record(replace(QUIET, encoder_step=step)).samples().position
    np.testing.assert_allclose(position / step, np.rint(position / step), atol=1e-9)
    assert np.abs(position - record(QUIET).samples().position).max() <= 0.5 * step


def test_currents_come_in_counts_as_large_as_their_noise() -> None:
    torque = record(Noise((0.2, 0.1), torque_step=1.0)).samples().effort
    np.testing.assert_allclose(torque / [0.2, 0.1], np.rint(torque / [0.2, 0.1]), atol=1e-9)


@pytest.mark.parametrize("every", [1, 4])
def test_autoregressive_noise_has_its_correlation_at_the_recorded_rate(every: int) -> None:
    quiet, noisy = record(QUIET, every), record(replace(QUIET, torque_std=(0.2, 0.3), kind="autoregressive"), every)
    noise = (noisy.samples().effort - quiet.samples().effort) / [0.2, 0.3]
    assert noise.std() == pytest.approx(1.0, abs=0.15)
    assert np.mean(noise[1:] * noise[:-1]) / np.mean(noise**2) == pytest.approx(0.95, abs=0.02)


def test_held_values_are_renewed_every_so_many_samples() -> None:
    good, held = record(QUIET).samples(), record(replace(QUIET, held=4)).samples()
    np.testing.assert_array_equal(held.time, good.time)
    for late in range(4):
        np.testing.assert_allclose(held.position[late::4], good.position[::4])
        np.testing.assert_allclose(held.effort[late::4], good.effort[::4], atol=1e-6)


def test_a_dropout_is_a_stretch_of_zero_torque() -> None:
    torque = record(replace(QUIET, dropouts=2)).samples().effort
    lost = np.all(torque == 0.0, axis=1)
    assert np.abs(np.diff(lost.astype(int))).sum() in {2, 4}
    assert 80 <= lost.sum() <= 162


def test_stamps_in_bunches_rise_and_end_at_honest_ones() -> None:
    good, bunched = record(QUIET).samples().time, record(replace(QUIET, bunched=0.05)).samples().time
    steps = np.diff(bunched)
    assert steps.min() > 0.0
    late = bunched > good + 1e-9
    assert 0.02 < late.mean() < 0.08
    assert (bunched - good).max() == pytest.approx((BUNCH - 1) * (1.0 / RATE_HZ - BUNCHED_S))
    assert np.all(bunched >= good - 1e-9)
