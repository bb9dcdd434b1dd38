"""Repeated excitation: where the periods lie, their average, and derivatives by Fourier series.

Averaging P periods takes the measurement noise down by √P on both sides of the equation without any filter's bias, and
what differs from period to period is noise by construction: no model is needed to see it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from service.recording.conditioning.uniform import Mask, Stretch
from service.recording.recording import Array

REPEATABILITY = 0.05
"""Largest rms of what differs in q̈ between periods, relative to q̈ itself, at which an average is still the motion: what is
lost is of second order, a quarter of a percent."""

FRACTIONAL_PERIOD = 0.02
"""Largest misfit of a period to the sampling grid, in samples over all periods, that needs no resampling."""


@dataclass(frozen=True, eq=False)
class Periods:
    """P complete periods of N samples, aligned.

    rate_hz : float
        sampling rate; a whole number of samples makes a period
    position, torque : (P, N, n) float64
        q and τ of every period
    measured : (P, N, n) bool
        where the torque was measured
    rows : (int, int)
        the samples of the stretch that the periods cover
    """

    rate_hz: float
    position: Array
    torque: Array
    measured: Mask
    rows: tuple[int, int]


def split_periods(stretch: Stretch) -> Periods | None:
    """The complete repeated periods of a stretch.

    Parameters
    ----------
    stretch : Stretch
        uniform motion with its column `period`

    Returns
    -------
    Periods or None
        None where fewer than two complete periods of equal length follow one another
    """
    if stretch.period is None:
        return None
    starts, length = _period_starts(stretch.period)
    if len(starts) < 2:
        return None
    count = round(length)
    first = starts[0]
    whole = [k for k in range(len(starts)) if round(first + k * length) + count <= len(stretch.position)]
    if len(whole) < 2:
        return None
    if abs(length - count) * len(whole) <= FRACTIONAL_PERIOD:
        index = first + np.arange(len(whole))[:, None] * count + np.arange(count)
        return Periods(
            stretch.rate_hz,
            stretch.position[index],
            stretch.torque[index],
            stretch.measured[index],
            (first, first + len(whole) * count),
        )
    return _resampled_periods(stretch, first, length, count, len(whole))


def repeats(periods: Periods, cutoff_hz: float) -> bool:
    """Whether the motion is the same in every period.

    Parameters
    ----------
    periods : Periods
        the periods
    cutoff_hz : float
        only what lies below matters [Hz]

    Returns
    -------
    bool
        False where tracking differs so much from period to period that an average would not be a motion
    """
    count = periods.position.shape[1]
    frequency = np.fft.rfftfreq(count, 1.0 / periods.rate_hz)[:, None]
    weight = np.where(frequency <= cutoff_hz, frequency**4, 0.0)
    mean = periods.position.mean(axis=0)
    motion = (weight * np.abs(np.fft.rfft(mean, axis=0)) ** 2).sum(axis=0)
    deviation = (weight * np.abs(np.fft.rfft(periods.position - mean, axis=1)) ** 2).sum(axis=1).mean(axis=0)
    return bool((deviation <= REPEATABILITY**2 * motion).all())


def fourier_derivatives(position: Array, rate_hz: float, cutoff_hz: float) -> tuple[Array, Array, Array]:
    """A periodic motion and its derivatives by its Fourier series, cut at the cut-off.

    q̇ = Σ i ω_l c_l e^{i ω_l t},  q̈ = −Σ ω_l² c_l e^{i ω_l t}.

    Parameters
    ----------
    position : (N, n) float64
        exactly one period of q [rad or m]
    rate_hz : float
        sampling rate [Hz]
    cutoff_hz : float
        highest harmonic kept [Hz]

    Returns
    -------
    tuple of (N, n) float64
        q, q̇, q̈
    """
    count = len(position)
    spectrum = np.fft.rfft(position, axis=0)
    frequency = np.fft.rfftfreq(count, 1.0 / rate_hz)[:, None]
    spectrum[frequency[:, 0] > cutoff_hz] = 0.0
    rate = 2j * np.pi * frequency
    if count % 2 == 0:
        rate[-1] = 0.0  # the derivative of the Nyquist term is not determined by its samples
    series = (spectrum, rate * spectrum, rate**2 * spectrum)
    smooth, velocity, acceleration = (np.fft.irfft(part, n=count, axis=0) for part in series)
    return smooth, velocity, acceleration


def _period_starts(period: Array) -> tuple[list[int], float]:
    """First samples of the longest run of consecutive periods, and their mean length in samples."""
    change = np.flatnonzero(np.diff(period) == 1.0) + 1
    change = change[np.isfinite(period[change - 1])]
    if len(change) == 0:
        return [], 0.0
    begin = int(change[0])
    while begin > 0 and period[begin - 1] == period[change[0] - 1]:
        begin -= 1
    if len(change) == 1:
        # One boundary: either period may be cut short, the longer one is the measure of their length.
        after = period[change[0] :] == period[change[0]]
        end = int(change[0]) + (len(after) if after.all() else int(np.argmin(after)))
        length = max(int(change[0]) - begin, end - int(change[0]))
        starts = [int(change[0]) - length, int(change[0])]
        return [start for start in starts if start >= 0], float(length)
    length = float(np.median(np.diff(change)))
    if np.ptp(np.diff(change)) > 2:
        return [], 0.0
    mean_length = float((change[-1] - change[0]) / (len(change) - 1))
    starts = [int(value) for value in change]
    if abs(change[0] - begin - length) <= 2:
        starts.insert(0, max(0, int(round(change[0] - mean_length))))
    return starts, mean_length


def _resampled_periods(stretch: Stretch, first: int, length: float, count: int, periods: int) -> Periods:
    """Periods whose length is no whole number of samples, brought onto a common grid of phases."""
    phase = first + (np.arange(periods)[:, None] + np.arange(count) / count) * length
    phase = np.minimum(phase, len(stretch.position) - 1)
    sample = np.arange(len(stretch.position))
    torque = np.stack([np.interp(phase, sample, column) for column in stretch.torque.T], axis=-1)
    left = np.minimum(np.floor(phase).astype(int), len(sample) - 2)
    return Periods(
        stretch.rate_hz * count / length,
        make_interp_spline(sample, stretch.position, k=3)(phase),
        torque,
        stretch.measured[left] & stretch.measured[left + 1],
        (first, min(int(np.ceil(first + periods * length)), len(sample))),
    )
