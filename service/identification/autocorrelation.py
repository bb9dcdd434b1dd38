"""Autocorrelation of residuals: autoregressive models with their order chosen by BIC.

A residual that leaves noise behind is rarely white: filters, friction and what the model lacks colour it. Standard
errors that ignore this are too small. An order that is fixed instead of chosen finds colour in white noise.
"""

from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from service.recording.recording import Array

LARGEST_ORDER = 30

UNBROKEN_SHARE = 0.3
"""Where samples are missing, orders end where fewer than this share of so many consecutive samples are all there: what
pairs at longer lags say no longer fits together."""


@dataclass(frozen=True, eq=False)
class Autoregression:
    """e_t = Σ a_k e_{t-k} + ε_t.

    coefficients : (p,) float64
        a_1 … a_p; empty for white noise
    innovation_variance : float
        variance of ε
    variance : float
        variance of e
    """

    coefficients: Array
    innovation_variance: float
    variance: float

    @property
    def order(self) -> int:
        """Number of coefficients p."""
        return len(self.coefficients)

    @property
    def long_run_ratio(self) -> float:
        """Spectral density at frequency zero over that of white noise of the same variance, at least 1.

        By this much a slowly varying coefficient's variance exceeds what independent residuals would give it.
        """
        if self.variance <= 0.0:
            return 1.0
        gain = 1.0 / (1.0 - self.coefficients.sum()) ** 2
        return max(1.0, float(self.innovation_variance * gain / self.variance))

    def colour(self, columns: Array) -> Array:
        """Columns run through σ_ε / a(z): their Gram matrix is LᵀΩL, Ω the residual's covariance.

        Parameters
        ----------
        columns : (k, M) float64
            signals, time last
        """
        scale = np.sqrt(self.innovation_variance)
        if self.order == 0:
            return columns * scale
        return signal.lfilter([scale], np.append(1.0, -self.coefficients), columns, axis=-1)


@dataclass(frozen=True, eq=False)
class LaggedProducts:
    """Σ e_t e_{t+k} of one stretch of a residual, and how many products that are.

    products, counts : (K + 1,) float64
        for the lags k = 0 … K; pairs of which one was not measured are left out of both
    spans : (K + 1,) float64
        pairs that there would be if all had been measured
    """

    products: Array
    counts: Array
    spans: Array

    @staticmethod
    def of(residual: Array, used: NDArray[np.bool_], lags: int = LARGEST_ORDER) -> "LaggedProducts":
        """The products of consecutive samples, those left out that do not count.

        Parameters
        ----------
        residual : (M,) float64
            consecutive samples
        used : (M,) bool
            which of them count
        lags : int
            largest lag K
        """
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
    """Lagged products of a residual, summed over pieces with samples missing.

    Parameters
    ----------
    lags : int
        largest lag; bounds the order of the model
    """

    def __init__(self, lags: int = LARGEST_ORDER) -> None:
        self._sums = LaggedProducts(np.zeros(lags + 1), np.zeros(lags + 1), np.zeros(lags + 1))

    def add(self, piece: LaggedProducts) -> None:
        """Add one piece.

        Parameters
        ----------
        piece : LaggedProducts
            its products, to the same largest lag
        """
        self._sums.products[:] += piece.products
        self._sums.counts[:] += piece.counts
        self._sums.spans[:] += piece.spans

    def model(self) -> Autoregression:
        """The autoregressive model of smallest BIC = N log σ_ε² + p log N, by Levinson's recursion."""
        count = float(self._sums.counts[0])
        if count < 2 or self._sums.products[0] <= 0.0:
            return Autoregression(np.empty(0), 0.0, 0.0)
        # The mean over the pairs at hand, shrunk as if divided by N at every lag: the sequence stays positive definite.
        taper = self._sums.spans / self._sums.spans[0]
        covariance = taper * self._sums.products / np.maximum(self._sums.counts, 1.0)
        present = count / self._sums.spans[0]
        unbroken = LARGEST_ORDER if present == 1.0 else np.log(UNBROKEN_SHARE) / np.log(present)
        largest = int(min(LARGEST_ORDER, len(covariance) - 1, count // 10, unbroken))
        variance = float(covariance[0])
        best, best_score = (np.empty(0), variance), count * log(variance)
        coefficients = np.zeros(largest)
        for order in range(1, largest + 1):
            before = coefficients[: order - 1]
            reflection = float(covariance[order] - before @ covariance[order - 1 : 0 : -1]) / variance
            before -= reflection * before[::-1]
            coefficients[order - 1] = reflection
            variance *= 1.0 - reflection**2
            if variance <= 0.0:
                break
            score = count * log(variance) + order * log(count)
            if score < best_score:
                best, best_score = (coefficients[:order].copy(), variance), score
        return Autoregression(*best, variance=float(covariance[0]))
