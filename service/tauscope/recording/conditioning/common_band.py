"""The band that torque and regressor share: one filter, one decimation, for both.

*Parallel filtering* (Gautier 1997): the torque and every column of the regressor pass the same linear filter and are
decimated together, so that τ = Φ Θ still holds row by row and noise above the band is gone from both sides.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import prod

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from tauscope.recording.recording import Array

OPEN_BAND_FRACTION = 0.45  # a cut-off above this part of the sampling rate filters nothing
STOP_BAND_DB = 60.0

# A filtered row is not used where more than this share of the filter's weight fell on samples never measured.
MASKED_FRACTION = 0.02
# The same where no gap is longer than a quarter of the time from row to row: a straight line across is the signal.
BRIDGED_FRACTION = 0.2
BLOCK_VALUES = 1 << 19  # numbers in the intermediate result of a decimation: bounds memory, and stays in the cache


class BandFilter(ABC):
    """A linear filter with decimation along the last axis, the same for torque and regressor."""

    rate_hz: float  # sampling rate of what comes out [Hz]

    @abstractmethod
    def reduce(self, values: Array) -> Array:
        """Values (..., N) filtered and decimated to (..., M). `values`: (..., N), signals, time last."""

    @abstractmethod
    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which of the M outputs rest on `measured` samples, (..., N) → (..., M)."""

    def filtered_white(self, lags: int) -> Array | None:
        """Autocovariance of white noise that passed, up to a factor, (lags + 1,); None where it is white still."""
        return None


@dataclass(frozen=True)
class AllPass(BandFilter):
    """No filter at all: for motion measured so cleanly that nothing needs to be cut."""

    rate_hz: float

    def reduce(self, values: Array) -> Array:
        """Values as they are. `values`: (..., N), signals, time last."""
        return values

    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """The mask as it is. `measured`: (..., N), where a sample was measured."""
        return measured


@dataclass(frozen=True, eq=False)
class Decimator(BandFilter):
    """Linear-phase low-pass (Kaiser window) evaluated only at every `factor`-th sample.

    Written as one matrix product per group of signals: with X the signal in blocks of D samples,
    y[m] = Σ_b (X H)[m+b, b], H the kernel in K/D columns. That is several times quicker than a convolution.
    """

    kernel: Array  # (K,), symmetric impulse response of unit sum; K is a multiple of `factor`
    factor: int
    rate_hz: float

    @staticmethod
    def design(rate_hz: float, cutoff_hz: float) -> "Decimator":
        """The decimator with half the amplitude left at `cutoff_hz`, and full stop from 1.5 times that on."""
        factor = max(1, int(rate_hz / (3.0 * cutoff_hz) + 1e-9))
        length, beta = signal.kaiserord(STOP_BAND_DB, 2.0 * cutoff_hz / rate_hz)
        # An even number of taps has a zero at Nyquist, which nothing but a decimation asks for.
        taps = length | 1 if factor == 1 else int(np.ceil(length / factor)) * factor
        kernel = signal.firwin(taps, cutoff_hz, window=("kaiser", beta), fs=rate_hz)
        return Decimator(kernel / kernel.sum(), factor, rate_hz / factor)

    def reduce(self, values: Array) -> Array:
        """Outputs whose whole kernel lies inside `values`, (..., N) → (..., M), M = max((N - K) // D + 1, 0)."""
        if self.factor == 1:  # a product with one column a block would be ten times slower
            first = len(self.kernel) // 2
            whole = ndimage.correlate1d(values, self.kernel, axis=-1, mode="constant")
            return whole[..., first : first + self._outputs(values.shape[-1])]
        blocks = len(self.kernel) // self.factor
        outputs = self._outputs(values.shape[-1])
        used = outputs + blocks - 1
        rows = values.reshape(prod(values.shape[:-1]), values.shape[-1])
        result = np.empty((len(rows), outputs))
        weight = self.kernel.reshape(blocks, self.factor).T
        group = max(1, BLOCK_VALUES // max(1, used * blocks))
        for start in range(0, len(rows) if outputs else 0, group):
            shaped = rows[start : start + group, : used * self.factor].reshape(-1, used, self.factor)
            partial = shaped @ weight
            total = partial[:, :outputs, 0].copy()
            for block in range(1, blocks):
                total += partial[:, block : block + outputs, block]
            result[start : start + group] = total
        return result.reshape(*values.shape[:-1], outputs)

    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Outputs that rest on `measured` samples (..., N): see `MASKED_FRACTION`, `BRIDGED_FRACTION`."""
        if measured.all():
            return np.ones((*measured.shape[:-1], self._outputs(measured.shape[-1])), dtype=bool)
        weight = np.abs(self.kernel)
        share = replace(self, kernel=weight / weight.sum())
        missed = share.reduce((~measured).astype(float))
        in_long_gaps = share.reduce(_mark_long_gaps(measured, self.factor // 4).astype(float))
        return (in_long_gaps <= MASKED_FRACTION) & (missed <= BRIDGED_FRACTION)

    def filtered_white(self, lags: int) -> Array:
        """Autocovariance of white noise that passed: Σ_i h_i h_{i + kD}, (lags + 1,)."""
        every = np.correlate(self.kernel, self.kernel, "full")[len(self.kernel) - 1 :: self.factor]
        return np.pad(every[: lags + 1], (0, max(0, lags + 1 - len(every))))

    def _outputs(self, count: int) -> int:
        return max(0, (count - len(self.kernel)) // self.factor + 1)


def _mark_long_gaps(measured: NDArray[np.bool_], bridged: int) -> NDArray[np.bool_]:
    """Samples (..., N) that were not measured and lie in a gap of more than `bridged` of them."""
    rows = measured.reshape(prod(measured.shape[:-1]), measured.shape[-1])
    result = np.zeros(rows.shape, dtype=bool)
    for row, known in zip(result, rows, strict=True):
        gaps = np.flatnonzero(np.diff(known, prepend=True, append=True)).reshape(-1, 2)
        long = gaps[:, 1] - gaps[:, 0] > bridged
        for start, stop in gaps[long]:
            row[start:stop] = True
    return result.reshape(measured.shape)


@dataclass(frozen=True)
class HarmonicBand(BandFilter):
    """The band of one averaged period: its harmonics up to the cut-off, sampled just often enough to hold them."""

    period_samples: int
    harmonics: int
    rate_hz: float

    @staticmethod
    def design(rate_hz: float, period_samples: int, cutoff_hz: float) -> "HarmonicBand":
        """The band of a period. `rate_hz`: sampling rate [Hz]; `cutoff_hz`: highest frequency kept [Hz]."""
        harmonics = min(int(cutoff_hz * period_samples / rate_hz + 1e-9), (period_samples - 1) // 2)
        return HarmonicBand(period_samples, harmonics, (2 * harmonics + 1) * rate_hz / period_samples)

    def reduce(self, values: Array) -> Array:
        """One period of `values` (..., N), band-limited and resampled to 2h + 1 points."""
        spectrum = np.fft.rfft(values, axis=-1)[..., : self.harmonics + 1]
        count = 2 * self.harmonics + 1
        return np.fft.irfft(spectrum, n=count, axis=-1) * (count / self.period_samples)

    def reduce_mask(self, measured: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """All True where the period was `measured`, (..., N), but for `MASKED_FRACTION` of it."""
        whole = measured.mean(axis=-1, keepdims=True) >= 1.0 - MASKED_FRACTION
        return np.broadcast_to(whole, (*measured.shape[:-1], 2 * self.harmonics + 1))
