"""Fourier series: exact derivatives, rest at the ends, and the bound between samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation.excited_arms import rest_error, resting_series
from tauscope.errors import ExcitationError
from tauscope.trajectory import FourierSeries
from tauscope.trajectory.fourier_series import between_samples


def test_the_paper_s_formulas_term_by_term() -> None:
    rng = np.random.default_rng(0)
    series = resting_series(rng, 2, harmonics=3, period_s=7.0)
    omega, time = 2.0 * np.pi / 7.0, 1.234
    motion = series.evaluate(np.array([time]))
    for i in range(2):
        q, qd, qdd = series.centre[i], 0.0, 0.0
        for l_ in (1, 2, 3):
            a, b, w = series.cosine[i, l_ - 1], series.sine[i, l_ - 1], omega * l_
            q += a / w * np.sin(w * time) - b / w * np.cos(w * time)
            qd += a * np.cos(w * time) + b * np.sin(w * time)
            qdd += -a * w * np.sin(w * time) + b * w * np.cos(w * time)
        np.testing.assert_allclose(
            [motion.position[0, i], motion.velocity[0, i], motion.acceleration[0, i]], [q, qd, qdd], rtol=1e-13
        )


def test_derivatives_match_complex_steps_of_the_position() -> None:
    series = resting_series(np.random.default_rng(1), 3)
    time, step = np.linspace(0.0, 10.0, 41), 1e-4
    position = [series.evaluate(time + k * step).position for k in (-2, -1, 0, 1, 2)]
    velocity = (position[0] - 8 * position[1] + 8 * position[3] - position[4]) / (12 * step)
    motion = series.evaluate(time)
    np.testing.assert_allclose(motion.velocity, velocity, atol=1e-10)
    before, after = (series.evaluate(time + sign * step).velocity for sign in (-1, 1))
    np.testing.assert_allclose(motion.acceleration, (after - before) / (2 * step), atol=1e-6)


def test_rest_at_the_ends_of_every_period() -> None:
    series = resting_series(np.random.default_rng(2), 4)
    ends = series.evaluate(np.array([0.0, 10.0, 50.0]))
    assert np.abs(ends.velocity).max() < 1e-12
    assert np.abs(ends.acceleration).max() < 1e-12
    assert max(rest_error(series)) < 1e-13
    moving = FourierSeries(10.0, np.zeros(1), np.array([[1.0, 0.0]]), np.zeros((1, 2)))
    assert rest_error(moving)[0] == pytest.approx(1.0)


@given(seed=st.integers(0, 2**32 - 1), harmonics=st.integers(2, 9), per_harmonic=st.integers(3, 40))
def test_nothing_between_samples_exceeds_the_bound(seed: int, harmonics: int, per_harmonic: int) -> None:
    series = resting_series(np.random.default_rng(seed), 1, harmonics)
    count = per_harmonic * harmonics
    coarse = series.evaluate(np.arange(float(count)) * (10.0 / count)).velocity
    fine = series.evaluate(np.arange(50.0 * count) * (0.2 / count)).velocity
    assert np.abs(fine).max() <= np.abs(coarse).max() * between_samples(harmonics, count) * (1.0 + 1e-12)


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, np.inf])
def test_a_period_is_a_positive_duration(period: float) -> None:
    with pytest.raises(ExcitationError, match="period"):
        FourierSeries(period, np.zeros(1), np.zeros((1, 2)), np.zeros((1, 2)))


def test_coefficients_that_do_not_belong_together() -> None:
    with pytest.raises(ExcitationError, match="2 joints"):
        FourierSeries(1.0, np.zeros(2), np.zeros((2, 3)), np.zeros((2, 2)))
