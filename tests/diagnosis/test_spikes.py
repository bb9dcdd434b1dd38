"""Single samples outside the noise, and everything that is none."""

import numpy as np
import pytest

from tauscope.diagnosis.observations.channels import without_spikes

RATE = 200.0
TIME = np.arange(8000) / RATE


def clean(rng: np.random.Generator, noise: float) -> np.ndarray:
    """Slow motion, friction's steps, a quick ripple; and noise."""
    slow = 8.0 * np.sin(0.9 * TIME) + 2.0 * np.sign(np.sin(1.7 * TIME)) + 0.3 * np.sin(40.0 * TIME)
    return (slow + noise * rng.standard_normal(len(TIME)))[None]


@pytest.mark.parametrize("noise", [0.02, 0.5])
def test_gaussian_noise_steps_and_waves_pass_as_they_are(noise: float) -> None:
    torque = clean(np.random.default_rng(1), noise)
    assert without_spikes(torque) == pytest.approx(torque, abs=1e-12)


def test_a_wrong_word_counts_no_more_than_noise() -> None:
    rng = np.random.default_rng(2)
    torque = clean(rng, 0.5)
    places = rng.choice(np.arange(50, 7950, 40), 30, replace=False)
    wrong = torque.copy()
    wrong[0, places] += rng.choice([-1.0, 1.0], 30) * 40.0
    assert np.abs(without_spikes(wrong) - torque).max() < 10.0 * 0.5
    assert np.abs(wrong - torque).max() == pytest.approx(40.0)


def test_the_mean_of_heavy_tails_scatters_less() -> None:
    """Student's t with three degrees of freedom: the mean of a window is what a contact is measured by."""
    rng = np.random.default_rng(3)
    heavy = rng.standard_t(3.0, (200, 400)) / np.sqrt(3.0)
    assert without_spikes(heavy).mean(axis=1).std() < 0.9 * heavy.mean(axis=1).std()


def test_torque_that_mostly_stands_still_is_left_alone() -> None:
    torque = np.zeros((1, 500))
    torque[0, ::50] = 1.0
    assert (without_spikes(torque) == torque).all()
