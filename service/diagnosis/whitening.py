"""The noise of one joint's rows, and the filter that makes it white."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from service.identification.autocorrelation import AutocovarianceSum, Autoregression, LaggedProducts
from service.recording.recording import Array

FLOOR = 0.01
"""Share of the noise's power that counts as white, so that whitening does not amplify by more than this what the
band's own filter has cut."""


@dataclass(frozen=True, eq=False)
class JointNoise:
    """Noise e_t = Σ a_k e_{t-k} + ε_t of one joint's rows in the common band.

    model : Autoregression
        its coefficients and variances
    """

    model: Autoregression

    @property
    def std(self) -> float:
        """Standard deviation of the innovations ε."""
        return float(np.sqrt(self.model.innovation_variance))

    @property
    def order(self) -> int:
        """Rows that the filter takes from the beginning of a piece."""
        return self.model.order

    def whitened(self, rows: Array) -> Array:
        """Rows (..., T) made white with unit variance, (..., T - p).

        Parameters
        ----------
        rows : (..., T) float64
            consecutive rows, time last
        """
        if not self.order:
            return rows / self.std
        filtered = signal.lfilter(np.append(1.0, -self.model.coefficients), [1.0], rows, axis=-1)
        return filtered[..., self.order :] / self.std

    def kept(self, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whitened rows (T - p,) of which all that went in was measured.

        Parameters
        ----------
        used : (T,) bool
            which rows rest on measured torque
        """
        if used.all():
            return used[self.order :]
        missed = np.convolve(~used, np.ones(self.order + 1))[: len(used)] > 0.5
        return ~missed[self.order :]


def fitted_noise(pieces: Iterable[tuple[Array, NDArray[np.bool_], float]]) -> JointNoise:
    """Noise model of smallest BIC of pieces that are noise alone.

    Parameters
    ----------
    pieces : iterable of ((T,) float64, (T,) bool, float)
        consecutive rows, which of them count, and the factor that turns their power into the noise's
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
    for rows, used, factor in pieces:  # what the filter makes of these rows: the floor must not count as noise
        kept = filtering.kept(used)
        squares += factor * float(np.sum(filtering.whitened(rows)[kept] ** 2))
        count += int(kept.sum())
    return JointNoise(Autoregression(model.coefficients, max(squares / max(count, 1), smallest), variance))
