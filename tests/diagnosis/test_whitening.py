"""The filter that makes a joint's noise white."""

import numpy as np
import pytest
from scipy import signal

from tauscope.diagnosis.observations.whitening import fitted_noise
from tauscope.recording.conditioning.common_band import Decimator


def colour_noise(rng: np.random.Generator, rows: int) -> np.ndarray:
    return signal.lfilter([1.0], [1.0, -0.5, 0.3], rng.standard_normal(rows + 200))[200:]


def test_autoregressive_noise_becomes_white_with_unit_variance() -> None:
    rng = np.random.default_rng(1)
    rows = colour_noise(rng, 20_000)
    noise = fitted_noise([(rows, np.ones(len(rows), bool), 1.0)])
    white = noise.whitened(rows)
    assert noise.order >= 2
    assert white.var() == pytest.approx(1.0, abs=0.05)
    lagged = [float(white[:-k] @ white[k:]) / len(white) for k in (1, 2, 3)]
    assert np.abs(lagged).max() < 0.04


def test_white_noise_is_only_scaled() -> None:
    rng = np.random.default_rng(2)
    rows = 3.0 * rng.standard_normal(5000)
    noise = fitted_noise([(rows, np.ones(len(rows), bool), 1.0)])
    assert noise.order == 0
    assert noise.std == pytest.approx(3.0, rel=0.05)


def test_whitened_rows_whose_past_was_not_measured_are_left_out() -> None:
    rng = np.random.default_rng(3)
    rows = colour_noise(rng, 5000)
    noise = fitted_noise([(rows, np.ones(len(rows), bool), 1.0)])
    used = np.ones(5000, bool)
    used[1000] = False
    kept = noise.kept(used)
    assert len(kept) == 5000 - noise.order
    missing = np.flatnonzero(~kept) + noise.order
    assert list(missing) == list(range(1000, 1001 + noise.order))


def test_the_scale_of_differences_between_repetitions_is_taken_out() -> None:
    rng = np.random.default_rng(4)
    repetitions = 0.7 * rng.standard_normal((3, 4000))
    deviation = repetitions - repetitions.mean(axis=0)
    noise = fitted_noise([(row, np.ones(4000, bool), 3 / 2) for row in deviation])
    assert noise.std == pytest.approx(0.7, rel=0.03)


def test_a_slow_column_explains_one_variance_of_noise_however_close_its_rows_lie() -> None:
    rng = np.random.default_rng(5)
    band = Decimator.design(200.0, 6.0)
    waves = np.sin(2.0 * np.pi * np.outer(np.linspace(0.4, 4.0, 25), np.arange(4000) / 200.0))
    share_of_nyquist = 2.0 * 6.0 / band.rate_hz
    gains, power, rows = [], 0.0, 0
    for _ in range(60):
        noise = fitted_noise(
            [(band.reduce(0.5 * rng.standard_normal(12_000)), np.ones(band.reduce(np.ones(12_000)).size, bool), 1.0)],
            share_of_nyquist,
        )
        white = noise.whitened(band.reduce(0.5 * rng.standard_normal(4000)))
        columns = noise.whitened(band.reduce(waves))
        gains.append((columns @ white) ** 2 / np.sum(columns**2, axis=1))
        power += float(white @ white)
        rows += noise.share * len(white)
    assert np.mean(gains) == pytest.approx(1.0, abs=0.12)
    assert power / rows == pytest.approx(1.0, abs=0.05)
    assert noise.share < 0.9
