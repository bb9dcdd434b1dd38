"""Zero-phase smoothing and central differences against closed forms."""

import numpy as np
import pytest

from tauscope.recording.conditioning.filters import DIFFERENCE_MARGIN, derivative, smooth, smooth_each, smoothing_margin


@pytest.mark.parametrize(("fraction_of_nyquist", "bound"), [(0.1, 2e-7), (0.2, 4e-5), (0.4, 8e-3)])
def test_the_difference_errs_as_its_order_says(fraction_of_nyquist: float, bound: float) -> None:
    rate = 100.0
    omega = np.pi * rate * fraction_of_nyquist
    time = np.arange(400) / rate
    error = derivative(np.sin(omega * time)[:, None], rate)[:, 0] / omega - np.cos(omega * time)
    worst = np.nanmax(np.abs(error))
    assert worst <= bound
    assert worst >= bound / 4


def test_polynomials_up_to_the_eighth_degree_are_exact() -> None:
    time = np.linspace(-1.0, 1.0, 41)
    for degree in range(9):
        slope = derivative(time[:, None] ** degree, 20.0)[:, 0]
        exact = degree * time ** max(degree - 1, 0)
        np.testing.assert_allclose(slope[DIFFERENCE_MARGIN:-DIFFERENCE_MARGIN], exact[4:-4], atol=1e-11)


def test_the_edges_of_a_derivative_are_not_pretended() -> None:
    slope = derivative(np.arange(20.0)[:, None], 10.0)[:, 0]
    assert np.isnan(slope[[0, 3, 16, 19]]).all()
    np.testing.assert_allclose(slope[4:16], 10.0)
    assert np.isnan(derivative(np.arange(8.0)[:, None], 10.0)).all()


@pytest.mark.parametrize(("frequency", "gain"), [(2.0, 1.0), (5.0, 1 / (1 + 0.5**8)), (10.0, 0.5), (20.0, 1 / 257.0)])
def test_smoothing_has_the_stated_gain_and_no_delay(frequency: float, gain: float) -> None:
    rate = 1000.0
    time = np.arange(4000) / rate
    inner = slice(smoothing_margin(rate, 10.0), -smoothing_margin(rate, 10.0))
    smoothed = smooth(np.sin(2 * np.pi * frequency * time)[:, None], rate, 10.0)[:, 0]
    parts = np.stack([np.sin(2 * np.pi * frequency * time), np.cos(2 * np.pi * frequency * time)], axis=1)
    (in_phase, quadrature), *_ = np.linalg.lstsq(parts[inner], smoothed[inner], rcond=None)
    assert in_phase == pytest.approx(gain, rel=2e-3, abs=3e-4)
    assert abs(quadrature) < 1e-4 * gain


def test_each_signal_has_its_own_band() -> None:
    signals = np.random.default_rng(3).standard_normal((300, 4))
    bands = np.array([5.0, 20.0, 5.0, 60.0])
    each = np.hstack([smooth(signals[:, [j]], 100.0, band) for j, band in enumerate(bands)])
    np.testing.assert_array_equal(smooth_each(signals, 100.0, bands), each)


@pytest.mark.parametrize("offset", [0.0, 1e4, -3e6])
def test_smoothing_keeps_constants_and_ramps_wherever_they_lie(offset: float) -> None:
    ramp = offset + np.linspace(0.0, 1.0, 500)[:, None]
    inner = slice(smoothing_margin(100.0, 5.0), -smoothing_margin(100.0, 5.0))
    np.testing.assert_allclose(smooth(ramp, 100.0, 5.0)[inner], ramp[inner], rtol=0, atol=1e-8 + 1e-12 * abs(offset))


def test_edges_have_settled_after_the_margin() -> None:
    rate, cutoff = 200.0, 5.0
    time = np.arange(3000) / rate
    whole = np.sin(2 * np.pi * 1.3 * time)[:, None]
    part = smooth(whole[1000:2000], rate, cutoff)
    margin = smoothing_margin(rate, cutoff)
    np.testing.assert_allclose(part[margin:-margin], smooth(whole, rate, cutoff)[1000:2000][margin:-margin], atol=2e-3)


def test_an_open_band_is_left_alone_and_costs_no_margin() -> None:
    noise = np.random.default_rng(0).normal(size=(50, 2))
    assert smooth(noise, 100.0, 45.0) is noise
    assert smoothing_margin(100.0, 45.0) == 0


def test_signals_shorter_than_the_padding_are_smoothed_without_complaint() -> None:
    short = smooth(np.arange(6.0)[:, None], 1000.0, 1.0)
    assert np.isfinite(short).all()
