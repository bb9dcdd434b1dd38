"""The noise of one joint's rows, and the filter that makes it white."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from tauscope.identification.autocorrelation import AutocovarianceSum, Autoregression, LaggedProducts
from tauscope.recording.recording import Array

WELL_INSIDE = 0.85  # part of the band in which its own filter leaves the noise as it is
FEWEST_FOR_SPECTRUM = 32
SMALLEST_SHARE = 0.3  # rows are never taken for more dependent than this
# Share of the noise's power that counts as white, so that whitening does not amplify by more than this what the band's
# own filter has cut.
FLOOR = 0.01


@dataclass(frozen=True, eq=False)
class JointNoise:
    """Noise e_t = Σ a_k e_{t-k} + ε_t of one joint's rows in the common band."""

    model: Autoregression
    share: float = 1.0

    @property
    def std(self) -> float:
        """Standard deviation of the innovations ε."""
        return float(np.sqrt(self.model.innovation_variance))

    @property
    def order(self) -> int:
        """Rows that the filter takes from the beginning of a piece."""
        return self.model.order

    def times(self, factor: float) -> "JointNoise":
        """Noise of the same colour, so many times as large."""
        power = factor**2
        model = Autoregression(
            self.model.coefficients, power * self.model.innovation_variance, power * self.model.variance
        )
        return replace(self, model=model)

    def at_least(self, std: float) -> "JointNoise":
        """Noise of the same colour, of a standard deviation not below `std`."""
        return self.times(max(1.0, std / float(np.sqrt(self.model.variance))))

    def whitened(self, rows: Array) -> Array:
        """Rows (..., T) made white with unit variance, (..., T - p). `rows`: (..., T), consecutive rows, time last."""
        if not self.order:
            return rows / self.std
        filtered = signal.lfilter(np.append(1.0, -self.model.coefficients), [1.0], rows, axis=-1)
        return filtered[..., self.order :] / self.std

    def kept(self, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whitened rows, (T - p,), of which all that went in was measured, `used`, (T,)."""
        if used.all():
            return used[self.order :]
        missed = np.convolve(~used, np.ones(self.order + 1))[: len(used)] > 0.5
        return ~missed[self.order :]


def fitted_noise(pieces: Iterable[tuple[Array, NDArray[np.bool_], float]], band_share: float = 1.0) -> JointNoise:
    """Noise model of smallest BIC of pieces that are noise alone.

    Within the band the whitened noise has unit density: its mean power is `JointNoise.share`. `pieces`: iterable of
    ((T,) , (T,) , float), consecutive rows, which of them count, and the factor that turns their power into the
    noise's.
    """
    pieces = list(pieces)
    total = AutocovarianceSum()
    for rows, used, factor in pieces:
        products = LaggedProducts.of(rows * np.sqrt(factor), used)
        products.products[0] *= 1.0 + FLOOR
        total.add(products)
    model = total.model()
    smallest = np.finfo(float).tiny
    variance = max(model.variance / (1.0 + FLOOR), smallest)
    filtering = JointNoise(Autoregression(model.coefficients, 1.0, variance))
    squares, count = 0.0, 0
    inside, whole = 0.0, 0.0
    for rows, used, factor in pieces:  # what the filter makes of these rows: the floor must not count as noise
        kept = filtering.kept(used)
        left = np.where(kept, filtering.whitened(rows), 0.0)
        squares += factor * float(left @ left)
        count += int(kept.sum())
        of_band, of_all = _densities(left, band_share)
        inside, whole = inside + factor * of_band * len(left), whole + factor * of_all * len(left)
    share = float(np.clip(whole / inside, SMALLEST_SHARE, 1.0)) if band_share < 1.0 and inside > 0.0 else 1.0
    innovation = max(squares / max(count, 1) / share, smallest)
    return JointNoise(Autoregression(model.coefficients, innovation, variance), share)


def _densities(rows: Array, band_share: float) -> tuple[float, float]:
    """Mean spectral density of rows well inside the band, and everywhere."""
    if len(rows) < FEWEST_FOR_SPECTRUM:
        return 0.0, 0.0
    power = np.abs(np.fft.rfft(rows * signal.windows.hann(len(rows), sym=False))) ** 2
    last = max(2, int(WELL_INSIDE * band_share * (len(power) - 1)))
    return float(power[1:last].mean()), float(power[1:].mean())


@dataclass(frozen=True, eq=False)
class RowWeighting:
    """What whitened rows of one joint are multiplied by, of whose columns it is not certain what they are.

    The columns of row i are wrong by something of standard deviation u_i of its own, and by errors S (k, R) that all
    rows share, each of unknown size with standard deviation 1. In units of the rows' noise their covariance is then

        W⁻² + W⁻¹ Sᵀ S W⁻¹,        W = diag(1/√(1 + u²)),

    and W followed by (I + SᵀS)^(-1/2) makes them white again. The second factor differs from I in k directions only.
    """

    weights: Array  # (R,), W: 1 where the columns are certain
    directions: Array  # (k, R), orthonormal, those of the shared errors among weighted rows
    shrinkage: Array  # (k,), share that is taken off along each: 0 where nothing is shared, 1 where nothing is left

    @staticmethod
    def of(weights: Array, shared: Array) -> "RowWeighting":
        """From `weights`, (R,), W, and `shared`, (k, R), S: each error at one std among weighted rows."""
        _, sizes, directions = np.linalg.svd(shared, full_matrices=False)
        return RowWeighting(weights, directions, 1.0 - 1.0 / np.sqrt(1.0 + sizes**2))

    def applied(self, rows: Array) -> Array:
        """Whitened rows as they count, (k, R). `rows`: (k, R), whitened rows."""
        weighted = rows * self.weights
        return weighted - ((weighted @ self.directions.T) * self.shrinkage) @ self.directions
