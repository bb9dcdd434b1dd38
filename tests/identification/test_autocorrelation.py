"""Autoregressive models of residuals: coefficients, order, long-run ratio, and the Gram matrix that they colour."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import linalg, signal, stats

from tauscope.identification.autocorrelation import (
    FILTERED_LAGS,
    LARGEST_ORDER,
    AutocovarianceSum,
    Autoregression,
    LaggedProducts,
)
from tauscope.recording.conditioning.common_band import Decimator

Array = NDArray[np.float64]

AR2 = np.array([0.6, 0.25])


def autoregressive(coefficients: Array, count: int, rng: np.random.Generator) -> Array:
    """A stationary sample: the first values, which still feel the start, are dropped."""
    innovations = rng.standard_normal(count + 500)
    return signal.lfilter([1.0], np.append(1.0, -coefficients), innovations)[500:]


def model_of(values: Array, used: NDArray[np.bool_] | None = None, lags: int = LARGEST_ORDER) -> Autoregression:
    total = AutocovarianceSum(lags)
    total.add(LaggedProducts.of(values, np.ones(len(values), dtype=bool) if used is None else used, lags))
    return total.model()


def autocovariance(model: Autoregression, count: int) -> Array:
    """The first lags of the model's own autocovariance, by its impulse response."""
    impulse = np.zeros(2000)
    impulse[0] = np.sqrt(model.innovation_variance)
    response = signal.lfilter([1.0], np.append(1.0, -model.coefficients), impulse)
    return np.array([response[: len(response) - lag] @ response[lag:] for lag in range(count)])


def test_levinson_gives_the_closed_form_of_order_two() -> None:
    """a1 = r1 (1 - r2) / (1 - r1²), a2 = (r2 - r1²) / (1 - r1²), with the sample's own r1 and r2."""
    values = autoregressive(AR2, 5000, np.random.default_rng(0))
    covariance = np.array([values[: len(values) - lag] @ values[lag:] for lag in range(3)]) / len(values)
    r1, r2 = covariance[1:] / covariance[0]
    expected = np.array([r1 * (1 - r2), r2 - r1**2]) / (1 - r1**2)
    model = model_of(values, lags=2)
    np.testing.assert_allclose(model.coefficients, expected, rtol=1e-10)
    assert model.variance == pytest.approx(covariance[0])
    assert model.innovation_variance == pytest.approx(covariance[0] * (1 - expected @ [r1, r2]))


@pytest.mark.parametrize("coefficients", [[0.9], [-0.7], [0.6, 0.25], [1.6, -0.8]])
def test_true_coefficients_are_found(coefficients: list[float]) -> None:
    """The variance of estimated coefficients is at most (1 - a²)/N-like: five of its roots are 5/√N."""
    truth = np.array(coefficients)
    values = autoregressive(truth, 40_000, np.random.default_rng(1))
    model = model_of(values)
    assert len(truth) <= model.order <= len(truth) + 2
    found = np.zeros(model.order)
    found[: len(truth)] = truth
    np.testing.assert_allclose(model.coefficients, found, atol=5 / np.sqrt(len(values)))
    assert model.innovation_variance == pytest.approx(1.0, rel=5 * np.sqrt(2 / len(values)))


def test_white_noise_is_called_white() -> None:
    """BIC adds an order by chance where χ²_k > k log N for some k: the bound is that of all chances together."""
    count, runs = 2000, 300
    chance = sum(stats.chi2.sf(order * np.log(count), order) for order in range(1, 31))
    orders = [model_of(np.random.default_rng(run).standard_normal(count)).order for run in range(runs)]
    assert np.count_nonzero(orders) <= stats.binom.ppf(1 - 1e-4, runs, chance)
    assert np.count_nonzero(orders) < 0.05 * runs


def test_an_autoregression_stays_one_where_samples_are_missed() -> None:
    """AR(1) of 0.9 with 30 % of 3,000 samples missed; a long-run ratio of 19."""
    orders, ratios = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noise = signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal(3500))[500:]
        total = AutocovarianceSum()
        total.add(LaggedProducts.of(noise, rng.random(len(noise)) > 0.3))
        orders.append(total.model().order)
        ratios.append(total.model().long_run_ratio)
    assert np.median(orders) <= 3
    assert 15.0 <= np.median(ratios) <= 23.0
    assert max(ratios) < 60.0


def low_density(model: Autoregression) -> float:
    """Spectral density at frequency zero, of unit density 1."""
    return float(model.innovation_variance / (1.0 - model.coefficients.sum()) ** 2)


def filtered_model(raw: Array, band: Decimator) -> Autoregression:
    """The model of what a low-pass leaves of a residual."""
    total = AutocovarianceSum(FILTERED_LAGS)
    rows = band.reduce(raw)
    products = LaggedProducts.of(rows, np.ones(len(rows), dtype=bool), FILTERED_LAGS)
    total.add(products, band.filtered_white(FILTERED_LAGS))
    return total.model()


@pytest.mark.parametrize(("rate_hz", "cutoff_hz"), [(200.0, 12.4), (1000.0, 5.0), (100.0, 30.0)])
def test_white_noise_behind_a_filter_is_told_to_a_few_percent(rate_hz: float, cutoff_hz: float) -> None:
    """The density at low frequency is 1 / D; its one unknown factor has the relative deviation √(2 / N)."""
    band = Decimator.design(rate_hz, cutoff_hz)
    raw = np.random.default_rng(10).standard_normal((40, 2000 * band.factor + len(band.kernel)))
    found = np.array([low_density(filtered_model(row, band)) for row in raw]) * band.factor
    assert abs(found.mean() - 1.0) < 0.03
    assert found.std() < 0.1


def test_colour_behind_a_filter_is_found_beside_the_filters() -> None:
    """AR(1) of 0.995 at 200 Hz below 12 Hz: most of its power lies below 0.2 Hz."""
    band = Decimator.design(200.0, 12.0)
    innovations = np.random.default_rng(11).standard_normal((20, 200_000))
    raw = signal.lfilter([1.0], [1.0, -0.995], innovations, axis=-1)
    found = np.array([low_density(filtered_model(row, band)) for row in raw]) * band.factor
    assert np.median(found) == pytest.approx(1.0 / 0.005**2, rel=0.1)


def test_pieces_add_up() -> None:
    """Lagged products do not reach from one piece into the next: two pieces that differ by sign are alike."""
    values = autoregressive(AR2, 4000, np.random.default_rng(3))
    total, mirrored = AutocovarianceSum(), AutocovarianceSum()
    used = np.ones(2000, dtype=bool)
    for piece, sign in ((values[:2000], 1.0), (values[2000:], -1.0)):
        total.add(LaggedProducts.of(piece, used))
        mirrored.add(LaggedProducts.of(sign * piece, used))
    np.testing.assert_array_equal(total.model().coefficients, mirrored.model().coefficients)


@pytest.mark.parametrize("values", [np.zeros(100), np.ones(1), np.empty(0)])
def test_nothing_to_learn_from(values: Array) -> None:
    model = model_of(values)
    assert (model.order, model.innovation_variance, model.long_run_ratio) == (0, 0.0, 1.0)


def test_the_long_run_ratio_is_the_spectrum_at_zero() -> None:
    """(1 + a) / (1 - a) for AR(1); negative correlation helps, and is not counted on."""
    values = autoregressive(np.array([0.9]), 200_000, np.random.default_rng(4))
    assert model_of(values).long_run_ratio == pytest.approx(19.0, rel=0.1)
    assert model_of(autoregressive(np.array([-0.7]), 20_000, np.random.default_rng(5))).long_run_ratio == 1.0


@pytest.mark.parametrize("coefficients", [[0.9], [-0.5], [1.6, -0.8]])
def test_coloured_columns_have_the_gram_matrix_of_the_residuals_covariance(coefficients: list[float]) -> None:
    """LᵀΩL with Ω Toeplitz, for columns that begin and end at rest (where the filter's start is not felt)."""
    truth = np.array(coefficients)
    values = autoregressive(truth, 60_000, np.random.default_rng(6))
    model = model_of(values)
    count = 1200
    window = np.zeros(count)
    window[200:-200] = signal.windows.hann(count - 400)
    columns = window * np.random.default_rng(7).standard_normal((4, count))
    coloured = model.colour(columns)
    omega = linalg.toeplitz(autocovariance(model, count))
    np.testing.assert_allclose(coloured @ coloured.T, columns @ omega @ columns.T, rtol=1e-6, atol=1e-6 * count)


def test_white_noise_colours_by_its_standard_deviation() -> None:
    model = Autoregression(np.empty(0), 4.0, 4.0)
    columns = np.random.default_rng(8).standard_normal((2, 50))
    np.testing.assert_allclose(model.colour(columns), 2.0 * columns)
