"""How noisy the positions are, and how wide a band they can stand.

Noise of density S_n in q becomes ω⁴ S_n in q̈. It biases every inertial parameter towards zero by the share that it has
in the energy of q̈ (errors in variables), so the band must end where that share grows too large.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal, stats

from tauscope.recording.conditioning.uniform import Stretch
from tauscope.recording.recording import Array

# Largest rms of noise in q̈, relative to the motion's own q̈, inside the band: a bias of its square, 0.16 %.
NOISE_SHARE = 0.04
PLATEAU = (0.6, 0.9)  # part of the spectrum, relative to Nyquist, that no arm moves in: what is there is noise
# A joint whose range is below this many noise standard deviations does not move, and sets no band.
STANDING_STILL = 10.0
SEGMENT = 1024  # samples in one segment of the averaged spectra
LOOK = 128  # samples in one look at the plateau
# Looks that hold more than this many times their median are of a joint that shakes, as one that sticks and slips does:
# that is motion, and does not count.
SHAKING = 3.0
BRIEF = 1.0 / 3.0  # where more than this share of all looks is such, the rest is of a joint at rest, and all count
# Independent segments among half-overlapping ones under a Hann window, relative to their number.
SEGMENT_OVERLAP_LOSS = 0.9
TINY = np.finfo(float).tiny

# The second difference of q is nearly white where q itself is not: its spectrum's leakage stays below the noise.
DIFFERENCE_ORDER = 2


@dataclass(frozen=True, eq=False)
class PositionNoise:
    """Noise of the measured positions."""

    density: Array  # (n,), one-sided spectral density S_n [rad²/Hz or m²/Hz]
    # widest band in which the q̈ that is used keeps to `NOISE_SHARE`; None where the whole spectrum does
    limit_hz: float | None
    joint_limits_hz: Array  # (n,), the same by joint; infinite where the whole spectrum does, or where it stands still
    step: Array  # (n,), step that the encoder rounds to [rad or m]; zero where it shows none


@dataclass(frozen=True, eq=False)
class AccelerationSpectrum:
    """Spectrum of q̈ from some signal, and the noise in it."""

    frequency: Array  # (F,) [Hz]
    power: Array  # (F, n), one-sided spectral density of q̈, with its noise
    gain: Array  # (F,), squared gain from the signal's noise to that of q̈
    density: Array  # (n,), one-sided spectral density of the signal's noise

    def widest_band(self, rate_hz: float) -> Array:
        """Widest band in which noise keeps to `NOISE_SHARE` of q̈, (n,) [Hz]; infinite where all of it does."""
        usable = self.frequency <= PLATEAU[1] * rate_hz / 2.0
        edge = (self.frequency + self.frequency[1] / 2.0)[usable, None]  # a sum up to a line ends half a line beyond it
        noise = (self.density * np.cumsum(self.gain)[:, None])[usable]
        motion = np.maximum(np.cumsum(self.power[usable], axis=0) - noise, 0.0)
        allowed = NOISE_SHARE**2 * np.maximum.accumulate(motion, axis=0)
        bearable = noise <= allowed
        last = np.clip(len(bearable) - 1 - np.argmax(bearable[::-1], axis=0), 1, len(bearable) - 2)
        joint = np.arange(noise.shape[1])
        # Between the last line that is bearable and the first that is not, their ratio grows as a power of frequency.
        before, beyond = ((np.log(noise + TINY) - np.log(allowed + TINY))[last + k, joint] for k in (0, 1))
        crossing = (before < 0.0) & (beyond > 0.0)
        part = np.where(crossing, before / np.where(crossing, before - beyond, 1.0), 0.0)
        limit = edge[last, 0] * (edge[last + 1, 0] / edge[last, 0]) ** part
        return np.where(bearable.all(axis=0), np.inf, limit)


def position_noise(stretches: Stretch | Sequence[Stretch], step: Array | None = None) -> PositionNoise:
    """Density of the positions' noise, and the band that it allows; `step`: (n,), by `encoder_step`."""
    stretches = [stretches] if isinstance(stretches, Stretch) else list(stretches)
    rate = stretches[0].rate_hz
    floor = 0.0 if step is None else np.square(step) / (6.0 * rate)
    spectrum = acceleration_spectrum([s.position for s in stretches], rate, DIFFERENCE_ORDER, floor)
    reach = np.max([np.ptp(np.ascontiguousarray(stretch.position.T), axis=1) for stretch in stretches], axis=0)
    moving = reach > STANDING_STILL * np.sqrt(spectrum.density * rate / 2.0)
    limits = np.where(moving, spectrum.widest_band(rate), np.inf)
    known = np.zeros(len(limits)) if step is None else step
    return PositionNoise(spectrum.density, lowest_limit(limits), limits, known)


def lowest_limit(limits_hz: Array) -> float | None:
    """The least of `limits_hz`, (n,); None where all are infinite."""
    lowest = float(limits_hz.min())
    return lowest if np.isfinite(lowest) else None


def acceleration_spectrum(
    signals: Sequence[Array], rate_hz: float, order: int, floor: Array | float = 0.0
) -> AccelerationSpectrum:
    """Spectrum of q̈ by differences of q (order 2), q̇ (1), q̈ (0), (N, n); `floor`: (n,) or float, of its density."""
    accelerations = [np.diff(values, n=order, axis=0) * rate_hz**order for values in signals]
    length = min(SEGMENT, max(len(values) for values in accelerations))
    spectra = [segment_spectra(values, rate_hz, length) for values in accelerations]
    shares = [min(len(values) / length, 1.0) for values in accelerations]  # a joint may move in a short piece alone
    segments = sum(share * len(each) for share, each in zip(shares, spectra, strict=True))
    frequency = np.arange(length // 2 + 1, dtype=np.float64) * (rate_hz / length)
    power = np.sum([share * each.sum(axis=0) for share, each in zip(shares, spectra, strict=True)], axis=0) / segments
    gain = _gain(frequency, rate_hz, order)
    density = np.maximum(_plateau_density(accelerations, rate_hz, order), floor)
    return AccelerationSpectrum(frequency, power, gain, density)


def _plateau_density(accelerations: Sequence[Array], rate_hz: float, order: int) -> Array:
    """Density of a signal's noise while nothing shakes, (n,)."""
    length = min(LOOK, max(len(values) for values in accelerations))
    frequency = np.arange(length // 2 + 1, dtype=np.float64) * (rate_hz / length)
    nyquist = rate_hz / 2.0
    plateau: NDArray[np.bool_] = (frequency >= PLATEAU[0] * nyquist) & (frequency <= PLATEAU[1] * nyquist)
    looks = np.concatenate(
        [segment_spectra(values, rate_hz, length)[:, plateau] for values in accelerations if len(values) >= length]
    )
    looks /= _gain(frequency[plateau], rate_hz, order)[:, None]
    whole = looks.mean(axis=1)
    calm = whole <= SHAKING * np.median(whole, axis=0)
    calm |= calm.mean(axis=0) < 1.0 - BRIEF
    count = calm.sum(axis=0)
    freedom = 2.0 * np.maximum(1.0, SEGMENT_OVERLAP_LOSS * count)
    skewness = stats.chi2.median(freedom) / freedom
    return np.median(np.sum(looks, axis=0, where=calm[:, None]) / count, axis=0) / skewness


def _gain(frequency: Array, rate_hz: float, order: int) -> Array:
    """Squared gain from a signal's noise to that of q̈, which is `order` differences away, (F,)."""
    return (2.0 * rate_hz * np.sin(np.pi * frequency / rate_hz)) ** (2 * order)


def segment_spectra(values: Array, rate_hz: float, length: int) -> Array:
    """Spectral densities (S, F, n) of overlapping segments of `values`, (N, n); quicker than `scipy.signal.welch`."""
    whole, last = min(length, len(values)), max(len(values) - length, 0)
    begins = np.linspace(0, last, int(np.ceil(last / (length - length // 2))) + 1).astype(int)
    segments = np.lib.stride_tricks.sliding_window_view(np.ascontiguousarray(values.T), whole, axis=1)[:, begins]
    window = signal.get_window("hann", whole)
    spectrum = np.fft.rfft((segments - segments.mean(axis=2, keepdims=True)) * window, length)
    density = (spectrum.real**2 + spectrum.imag**2) / (rate_hz * np.sum(window**2))
    density[..., 1 : (length + 1) // 2] *= 2.0  # the negative frequencies; zero and Nyquist's have none
    return np.moveaxis(density, 0, -1)


def encoder_step(positions: Sequence[Array]) -> Array:
    """Least difference of recorded positions beyond rounding, (n,) [rad or m]; pieces of (N, n), not interpolated."""
    columns = np.concatenate(positions).T
    return np.array([_smallest_difference(column[np.isfinite(column)]) for column in columns])


def _smallest_difference(values: Array) -> float:
    differences = np.diff(np.sort(values))
    differences = differences[differences > 8.0 * np.spacing(np.abs(values).max(initial=0.0))]
    return float(differences.min(initial=np.inf)) if len(differences) else 0.0
