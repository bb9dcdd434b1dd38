"""Autocorrelation of residuals: autoregressive models with their order chosen by BIC.

A residual that leaves noise behind is rarely white: filters, friction and what the model lacks colour it. Standard
errors that ignore this are too small. An order that is fixed instead of chosen finds colour in white noise.

What a known filter does to white noise need not be learnt from it: where the band's filter is told, its colour is taken
out first, and the order chosen says what colour there is besides. Ten orders spent on a low-pass would leave the
density at low frequency, which is what standard errors rest on, uncertain by a fifth and more.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from tauscope.recording.recording import Array

LARGEST_ORDER = 30

FILTER_ORDER = 24  # orders that stand for the band's filter: the density in the pass band is that of all orders to 1 %
# White noise that is added to a filtered residual, as a share of its variance: the stop band is empty, and an
# autoregression that is to follow it that far down needs hundreds of orders.
FILTER_FLOOR = 1e-2
FILTERED_LAGS = LARGEST_ORDER + FILTER_ORDER  # lags that a model of a filtered residual needs
# Where samples are missing, orders end where fewer than this share of so many consecutive samples are all there: what
# pairs at longer lags say no longer fits together.
UNBROKEN_SHARE = 0.3
SMALLEST_SHARE = 1e-3  # …and at least so many are: a share of none has no logarithm


@dataclass(frozen=True, eq=False)
class Autoregression:
    """e_t = Σ a_k e_{t-k} + ε_t. `coefficients`: (p,), a_1 … a_p; empty for white noise."""

    coefficients: Array
    innovation_variance: float
    variance: float

    @property
    def order(self) -> int:
        """Number of coefficients p."""
        return len(self.coefficients)

    @property
    def long_run_ratio(self) -> float:
        """Spectral density at frequency zero over white noise's, ≥ 1: inflates a slow coefficient's variance."""
        if self.variance <= 0.0:
            return 1.0
        gain = 1.0 / (1.0 - self.coefficients.sum()) ** 2
        return max(1.0, float(self.innovation_variance * gain / self.variance))

    def colour(self, columns: Array) -> Array:
        """`columns`, (k, M), run through σ_ε / a(z): their Gram matrix is LᵀΩL, Ω the residual's covariance."""
        scale = np.sqrt(self.innovation_variance)
        if self.order == 0:
            return columns * scale
        return signal.lfilter([scale], np.append(1.0, -self.coefficients), columns, axis=-1)


@dataclass(frozen=True, eq=False)
class LaggedProducts:
    """Σ e_t e_{t+k} of one stretch of a residual, and how many products that are."""

    products: Array  # (K + 1,), for the lags k = 0 … K; pairs of which one was not measured are left out
    counts: Array  # (K + 1,), of the products
    spans: Array  # (K + 1,), pairs that there would be if all had been measured

    @staticmethod
    def of(residual: Array, used: NDArray[np.bool_], lags: int = LARGEST_ORDER) -> "LaggedProducts":
        """The products of consecutive samples `residual`, (M,), of which those `used`, (M,), count."""
        sums = LaggedProducts(np.zeros(lags + 1), np.zeros(lags + 1), np.zeros(lags + 1))
        whole = bool(used.all())
        kept = residual if whole else np.where(used, residual, 0.0)
        presence = None if whole else used.astype(float)
        for lag in range(min(lags + 1, len(kept))):
            stop = len(kept) - lag
            sums.products[lag] = kept[:stop] @ kept[lag:]
            sums.counts[lag] = stop if presence is None else presence[:stop] @ presence[lag:]
            sums.spans[lag] = stop
        return sums


class AutocovarianceSum:
    """Lagged products of a residual, summed over pieces with samples missing."""

    def __init__(self, lags: int = LARGEST_ORDER) -> None:
        self._sums = LaggedProducts(np.zeros(lags + 1), np.zeros(lags + 1), np.zeros(lags + 1))
        self._white = np.zeros(lags + 1)

    def add(self, piece: LaggedProducts, filtered_white: Array | None = None) -> None:
        """Add one piece; `filtered_white`: (K + 1,), of white noise that passed its filter, None where none."""
        both = slice(min(len(piece.products), len(self._sums.products)))
        self._sums.products[both] += piece.products[both]
        self._sums.counts[both] += piece.counts[both]
        self._sums.spans[both] += piece.spans[both]
        if filtered_white is None:
            self._white[0] += piece.counts[0]
        else:
            self._white += piece.counts[0] / filtered_white[0] * filtered_white

    def model(self) -> Autoregression:
        """The filter's colour times the autoregressive model of smallest BIC = N log σ_ε² + p log N."""
        count = float(self._sums.counts[0])
        if count < 2 or self._sums.products[0] <= 0.0:
            return Autoregression(np.empty(0), 0.0, 0.0)
        # The mean over the pairs at hand, shrunk as if divided by N at every lag: the sequence stays positive definite.
        taper = self._sums.spans / self._sums.spans[0]
        covariance = taper * self._sums.products / np.maximum(self._sums.counts, 1.0)
        follows = min(_following_share(self._sums), 1.0)
        unbroken = np.inf if follows == 1.0 else np.log(UNBROKEN_SHARE) / np.log(max(follows, SMALLEST_SHARE))
        reach = int(min(len(covariance) - 1, count // 10, unbroken))
        whitener = np.ones(1)
        if self._white[1:].any():
            whitener = _prediction_error_filter(_add_floor(self._white), min(FILTER_ORDER, reach // 2))
            covariance = _add_floor(covariance)
        whitened = _filter(covariance[: reach + 1], whitener)
        orders = list(_levinson(whitened, min(LARGEST_ORDER, len(whitened) - 1)))
        if not orders:  # pairs of what was measured fit together no more
            return Autoregression(np.empty(0), float(covariance[0]), variance=float(covariance[0]))
        scores = [count * log(variance) + len(found) * log(count) for found, variance in orders]
        coefficients, variance = orders[int(np.argmin(scores))]
        both = np.convolve(whitener, np.append(1.0, -coefficients))
        return Autoregression(-both[1:], variance, variance=float(covariance[0]))


def _following_share(sums: LaggedProducts) -> float:
    """Share of the measured samples that another one follows: near 1 where what is missing lies together."""
    pairs = sums.spans[1] * sums.counts[0] / sums.spans[0]
    return float(sums.counts[1] / pairs) if pairs > 0.0 else 0.0


def _levinson(covariance: Array, largest: int) -> Iterator[tuple[Array, float]]:
    """Coefficients and innovation variance of the autoregressions of order 0, 1 … by Levinson's recursion."""
    variance = float(covariance[0])
    if variance <= 0.0:
        return
    coefficients = np.zeros(largest)
    yield np.empty(0), variance
    for order in range(1, largest + 1):
        before = coefficients[: order - 1]
        reflection = float(covariance[order] - before @ covariance[order - 1 : 0 : -1]) / variance
        before -= reflection * before[::-1]
        coefficients[order - 1] = reflection
        variance *= 1.0 - reflection**2
        if variance <= 0.0:
            return
        yield coefficients[:order].copy(), variance


def _add_floor(covariance: Array) -> Array:
    return np.append((1.0 + FILTER_FLOOR) * covariance[0], covariance[1:])


def _prediction_error_filter(covariance: Array, order: int) -> Array:
    """1 - Σ a_k z⁻ᵏ that whitens noise of this autocovariance."""
    *_, (coefficients, _variance) = _levinson(covariance, order)  # of white noise, which has a variance
    return np.append(1.0, -coefficients)


def _filter(covariance: Array, taps: Array) -> Array:
    """Autocovariance of what leaves a filter of K taps, from that of what enters it: shorter by K - 1 lags."""
    both_sides = np.append(covariance[:0:-1], covariance)
    leaving = np.convolve(both_sides, np.correlate(taps, taps, "full"), "valid")
    return leaving[len(leaving) // 2 :]
