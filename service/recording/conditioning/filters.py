"""Zero-phase filters: smoothing of the motion, its derivatives, and one band for torque and regressor.

*Parallel filtering* (Gautier 1997): the torque and every column of the regressor pass the same linear filter and are
decimated together, so that τ = Φ Θ still holds row by row and noise above the band is gone from both sides.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from service.recording.recording import Array

CENTRAL_DIFFERENCE = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0.0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
"""First derivative of eighth order on nine points: error (2πf/fs)⁸/630, below 1e-6 at a fifth of Nyquist."""

DIFFERENCE_MARGIN = len(CENTRAL_DIFFERENCE) // 2

STATE_BAND_RATIO = 2.0
"""Cut-off of the motion's smoothing filter over that of the common band: it must not bend what the band passes."""

STOP_BAND_DB = 60.0

MASKED_FRACTION = 0.02
"""A filtered row is not used where more than this share of the filter's weight fell on samples never measured."""


def smooth(values: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """Zero-phase low-pass, fourth-order Butterworth run forwards and backwards.

    |H(f)| = 1 / (1 + (f/f_c)⁸).

    Parameters
    ----------
    values : (N, n) float64
        signals, a column each
    rate_hz : float
        sampling rate [Hz]
    cutoff_hz : float
        f_c, where half the amplitude is left [Hz]; at or above 0.45 of the rate nothing is filtered

    Returns
    -------
    (N, n) float64
        the smoothed signals; the first and last `smoothing_margin` samples still feel the edge
    """
    if cutoff_hz >= 0.45 * rate_hz:
        return values
    sections = signal.butter(4, cutoff_hz, output="sos", fs=rate_hz)
    padding = min(smoothing_margin(rate_hz, cutoff_hz), len(values) - 1)
    return signal.sosfiltfilt(sections, values, axis=0, padlen=padding)


def smoothing_margin(rate_hz: float, cutoff_hz: float) -> int:
    """Samples at each end that `smooth` cannot be trusted with: the slowest pole has decayed to 0.1 %.

    Parameters
    ----------
    rate_hz, cutoff_hz : float
        sampling rate and cut-off [Hz]
    """
    return int(np.ceil(3.0 * rate_hz / cutoff_hz))


def derivative(values: Array, rate_hz: float) -> Array:
    """First derivative in time by `CENTRAL_DIFFERENCE`.

    Parameters
    ----------
    values : (N, n) float64
        signals, a column each
    rate_hz : float
        sampling rate [Hz]

    Returns
    -------
    (N, n) float64
        the derivative [1/s]; the first and last `DIFFERENCE_MARGIN` rows are NaN
    """
    result = np.full_like(values, np.nan)
    inner = len(values) - 2 * DIFFERENCE_MARGIN
    if inner <= 0:
        return result
    total = np.zeros((inner, values.shape[1]))
    for offset, weight in enumerate(CENTRAL_DIFFERENCE):
        if weight:
            total += (weight * rate_hz) * values[offset : offset + inner]
    result[DIFFERENCE_MARGIN:-DIFFERENCE_MARGIN] = total
    return result


class BandFilter(Protocol):
    """A linear filter with decimation along the last axis, the same for torque and regressor."""

    @property
    def rate_hz(self) -> float:
        """Sampling rate of what comes out [Hz]."""
        ...

    def reduce(self, values: Array) -> Array:
        """Values (..., N) filtered and decimated to (..., M)."""
        ...

    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which of the M outputs rest on measured samples, (..., N) → (..., M)."""
        ...


@dataclass(frozen=True)
class AllPass:
    """No filter at all: for motion measured so cleanly that nothing needs to be cut."""

    rate_hz: float

    def reduce(self, values: Array) -> Array:
        """Values as they are.

        Parameters
        ----------
        values : (..., N) float64
            signals, time last
        """
        return values

    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The mask as it is.

        Parameters
        ----------
        measured : (..., N) bool
            where a sample was measured
        """
        return measured


@dataclass(frozen=True, eq=False)
class Decimator:
    """Linear-phase low-pass (Kaiser window) evaluated only at every `factor`-th sample.

    kernel : (K,) float64
        symmetric impulse response of unit sum; K is a multiple of `factor`
    factor : int
        decimation D
    rate_hz : float
        sampling rate after decimation [Hz]

    Written as one matrix product per group of signals: with X the signal in blocks of D samples,
    y[m] = Σ_b (X H)[m+b, b], H the kernel in K/D columns. That is several times quicker than a convolution.
    """

    kernel: Array
    factor: int
    rate_hz: float

    @staticmethod
    def design(rate_hz: float, cutoff_hz: float) -> "Decimator":
        """The decimator for one band.

        Parameters
        ----------
        rate_hz : float
            sampling rate of the signals [Hz]
        cutoff_hz : float
            where half the amplitude is left [Hz]; full stop from 1.5 times that on, which becomes the Nyquist frequency
        """
        factor = max(1, int(rate_hz / (3.0 * cutoff_hz)))
        length, beta = signal.kaiserord(STOP_BAND_DB, 2.0 * cutoff_hz / rate_hz)
        blocks = int(np.ceil((length | 1) / factor))
        taps = signal.firwin(length | 1, cutoff_hz, window=("kaiser", beta), fs=rate_hz)
        spare = blocks * factor - len(taps)
        kernel = np.pad(taps, (spare // 2, spare - spare // 2))
        return Decimator(kernel / kernel.sum(), factor, rate_hz / factor)

    def reduce(self, values: Array) -> Array:
        """Signals filtered and decimated; only outputs whose whole kernel lies inside the signal.

        Parameters
        ----------
        values : (..., N) float64
            signals, time last

        Returns
        -------
        (..., M) float64
            M = (N - K) // D + 1
        """
        blocks = len(self.kernel) // self.factor
        outputs = (values.shape[-1] - len(self.kernel)) // self.factor + 1
        if outputs <= 0:
            return np.empty((*values.shape[:-1], 0))
        used = (outputs + blocks - 1) * self.factor
        shaped = values[..., :used].reshape(*values.shape[:-1], outputs + blocks - 1, self.factor)
        partial = shaped @ self.kernel.reshape(blocks, self.factor).T
        result = partial[..., :outputs, 0].copy()
        for block in range(1, blocks):
            result += partial[..., block : block + outputs, block]
        return result

    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Outputs of which at most `MASKED_FRACTION` of the kernel's weight met a sample that was not measured.

        Parameters
        ----------
        measured : (..., N) bool
            where a sample was measured
        """
        outputs = (measured.shape[-1] - len(self.kernel)) // self.factor + 1
        if measured.all():
            return np.ones((*measured.shape[:-1], max(outputs, 0)), dtype=bool)
        weight = np.abs(self.kernel)
        unmeasured = Decimator(weight / weight.sum(), self.factor, self.rate_hz).reduce((~measured).astype(float))
        return unmeasured <= MASKED_FRACTION


@dataclass(frozen=True)
class HarmonicBand:
    """The band of one averaged period: its harmonics up to the cut-off, sampled just often enough to hold them.

    period_samples : int
        samples in the period, N
    harmonics : int
        highest harmonic kept, h; the output has M = 2h + 1 samples, on which white noise stays white
    rate_hz : float
        sampling rate of the output [Hz]
    """

    period_samples: int
    harmonics: int
    rate_hz: float

    @staticmethod
    def design(rate_hz: float, period_samples: int, cutoff_hz: float) -> "HarmonicBand":
        """The band of a period.

        Parameters
        ----------
        rate_hz : float
            sampling rate [Hz]
        period_samples : int
            samples in the period
        cutoff_hz : float
            highest frequency kept [Hz]
        """
        harmonics = min(int(cutoff_hz * period_samples / rate_hz), (period_samples - 1) // 2)
        return HarmonicBand(period_samples, harmonics, (2 * harmonics + 1) * rate_hz / period_samples)

    def reduce(self, values: Array) -> Array:
        """Signals of one period, band-limited and resampled to 2h + 1 points.

        Parameters
        ----------
        values : (..., N) float64
            one period, time last
        """
        spectrum = np.fft.rfft(values, axis=-1)[..., : self.harmonics + 1]
        count = 2 * self.harmonics + 1
        return np.fft.irfft(spectrum, n=count, axis=-1) * (count / self.period_samples)

    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """All True where every sample was measured in some period: a harmonic needs the whole period.

        Parameters
        ----------
        measured : (..., N) bool
            where a sample was measured in at least one period
        """
        whole = measured.mean(axis=-1, keepdims=True) >= 1.0 - MASKED_FRACTION
        return np.broadcast_to(whole, (*measured.shape[:-1], 2 * self.harmonics + 1))
