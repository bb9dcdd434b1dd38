"""Repeated excitation: the periods side by side, their average, and derivatives by Fourier series.

Averaging P periods takes the measurement noise down by √P on both sides of the equation without any filter's bias, and
what differs from period to period is noise by construction: no model is needed to see it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import make_interp_spline

from tauscope.recording.conditioning.uniform import Mask, Stretch
from tauscope.recording.recording import Array
from tauscope.robot.robot import JointType

# Largest rms of what differs in q̈ between periods, relative to q̈ itself, at which an average is still the motion:
# what is lost is of second order, a quarter of a percent.
REPEATABILITY = 0.05
# What differs may be this many times the noise that the positions are known to have: averaging is for noise.
NOISE_ALLOWANCE = 3.0
# A joint need not repeat better than if its q̈ were this share of the liveliest joint's: some stand nearly still.
LIVELIEST_SHARE = 0.1
# Largest misfit of the periods to the sampling grid, in samples over all periods, that needs no interpolation.
WHOLE_SAMPLES = 5e-3
# Lag from period to period, in samples, beyond which the labels, not the positions, must be wrong about a length that
# is a whole number of samples.
MISLABELLED = 0.05
ALIGNED = 1e-4  # lag from period to period, in samples, at which periods lie on one another
REFINEMENTS = 4  # Newton steps towards the length at which the positions repeat best; it settles in two
LATE_SAMPLES = 1.0  # samples that the last period may lack
SPLINE_DEGREE = 3

LEAST_WIDTH = 1e-15  # scatter below which a joint stands still [rad or m]


@dataclass(frozen=True)
class Periods:
    """P complete periods of N samples, aligned."""

    rate_hz: float
    position: Array  # (P, N, n), q of every period
    torque: Array  # (P, N, n)
    measured: Mask  # (P, N, n), where the torque was measured
    rows: tuple[int, int]  # (int, int), the samples of the stretch that the periods cover
    start_s: float = 0.0
    velocity: Array | None = None  # (P, N, n), recorded q̇, where the stretch has it
    acceleration: Array | None = None  # (P, N, n), recorded q̈
    advance: Array | None = None  # (n,), how far a joint gets from period to period [rad or m]; None where nobody asked

    @property
    def count(self) -> int:
        """Number of periods P."""
        return len(self.position)


def split_periods(stretch: Stretch, refine: bool = False) -> Periods | None:
    """All whole periods of the longest repeated part, from wherever it begins; None where there are fewer than two."""
    if stretch.period is None or len(stretch.period) < 3:
        return None
    part = _longest_steady(stretch.period)
    if part is None:
        return None
    first, last = part
    length = (last - first) / float(stretch.period[last] - stretch.period[first])
    for _ in range(1 + REFINEMENTS * refine):
        count = int((last + 1 + LATE_SAMPLES - first) / length + WHOLE_SAMPLES)
        if count < 2 or length < 3:
            return None
        periods = _align(stretch, first, length, count)
        if not refine or periods is None:
            return periods
        lag = _lag(periods.position) * stretch.rate_hz / periods.rate_hz
        is_whole = periods.rate_hz == stretch.rate_hz
        if abs(lag) <= (MISLABELLED if is_whole else ALIGNED):
            return periods
        length += lag
    return periods


def _align(stretch: Stretch, first: int, length: float, count: int) -> Periods | None:
    samples = round(length)
    fits = first + count * samples <= len(stretch.position)
    if fits and abs(length - samples) * count <= WHOLE_SAMPLES:
        return _whole(stretch, first, samples, count)
    return _interpolate(stretch, first, length, count)


def with_turns_removed(periods: Periods, joint_types: Sequence[JointType]) -> Periods | None:
    """The periods without whole turns; None where a joint ends one elsewhere: gravity differs then."""
    steps = periods.count - 1
    centre = periods.position.mean(axis=1)
    advance = (centre[-1] - centre[0]) / steps
    turning = np.array([kind is JointType.REVOLUTE for kind in joint_types])
    turns = np.where(turning, np.rint(advance / (2.0 * np.pi)), 0.0) * 2.0 * np.pi
    position = periods.position - np.arange(periods.count)[:, None, None] * turns
    rest = np.abs(advance - turns) * steps
    if (rest > REPEATABILITY * np.ptp(position[0], axis=0) + NOISE_ALLOWANCE * _scatter(position)).any():
        return None
    return replace(periods, position=position, advance=advance)


def repeats(periods: Periods, cutoff_hz: float, noise_density: Array) -> bool:
    """Whether motion below a cut-off repeats well; `noise_density`: (n,), one-sided, of q [rad²/Hz or m²/Hz]."""
    samples = periods.position.shape[1]
    frequency = np.fft.rfftfreq(samples, 1.0 / periods.rate_hz)[:, None]
    weight = np.where(frequency <= cutoff_hz, frequency**4, 0.0)
    mean = periods.position.mean(axis=0)
    ramp = 0.0 if periods.advance is None else np.arange(samples)[:, None] / samples * periods.advance
    motion = (weight * np.abs(np.fft.rfft(mean - ramp, axis=0)) ** 2).sum(axis=0)
    deviation = (weight * np.abs(np.fft.rfft(periods.position - mean, axis=1)) ** 2).sum(axis=1).mean(axis=0)
    noise = weight.sum() * samples * noise_density * periods.rate_hz / 2.0
    motion = np.maximum(motion, LIVELIEST_SHARE**2 * motion.max())
    return bool((deviation <= REPEATABILITY**2 * motion + NOISE_ALLOWANCE * noise).all())


def fourier_derivatives(
    values: Array, rate_hz: float, cutoff_hz: float, advance: Array | None = None, orders: Sequence[int] = (0, 1, 2)
) -> tuple[Array, ...]:
    """A periodic motion and its derivatives by its Fourier series, cut at the cut-off.

    q̇ = Σ i ω_l c_l e^{i ω_l t},  q̈ = −Σ ω_l² c_l e^{i ω_l t}.

    `values`: (N, n), exactly one period of q [rad or m], or of a derivative of it.
    `advance`: (n,), what a joint that turns on and on gains in one period: the series is that of q less this ramp.
    Returns (N, n) arrays: q, q̇, q̈, or those that `orders` names.
    """
    count = len(values)
    ramp = np.zeros(values.shape[1]) if advance is None else advance
    spectrum = np.fft.rfft(values - np.arange(count)[:, None] / count * ramp, axis=0)
    frequency = np.fft.rfftfreq(count, 1.0 / rate_hz)[:, None]
    spectrum[frequency[:, 0] > cutoff_hz * (1.0 + 1e-9)] = 0.0
    rate = 2j * np.pi * frequency
    if count % 2 == 0:
        rate[-1] = 0.0  # the derivative of the Nyquist term is not determined by its samples
    straight = (np.arange(count)[:, None] / count * ramp, ramp * rate_hz / count, np.zeros_like(ramp))
    return tuple(np.fft.irfft(rate**order * spectrum, n=count, axis=0) + straight[order] for order in orders)


def _longest_steady(progress: Array) -> tuple[int, int] | None:
    """First and last sample of the longest part in which progress grows by the same from sample to sample."""
    step = np.diff(progress)
    finite = np.isfinite(step)
    if not finite.any():
        return None
    typical = float(np.median(step[finite]))
    steady = finite & (np.abs(step - typical) <= 0.25 * abs(typical)) & (step > 0)
    edges = np.flatnonzero(np.diff(steady, prepend=False, append=False)).reshape(-1, 2)
    if not len(edges):
        return None
    first, last = edges[np.argmax(edges[:, 1] - edges[:, 0])]
    return int(first), int(last)


def _whole(stretch: Stretch, first: int, samples: int, count: int) -> Periods:
    index = first + np.arange(count)[:, None] * samples + np.arange(samples)
    return Periods(
        rate_hz=stretch.rate_hz,
        position=stretch.position[index],
        torque=stretch.torque[index],
        measured=stretch.measured[index],
        rows=(first, first + count * samples),
        start_s=stretch.start_s + first / stretch.rate_hz,
        velocity=None if stretch.velocity is None else stretch.velocity[index],
        acceleration=None if stretch.acceleration is None else stretch.acceleration[index],
    )


def _interpolate(stretch: Stretch, first: int, length: float, count: int) -> Periods | None:
    """Periods whose length is no whole number of samples, brought onto a common grid of phases by cubic splines."""
    samples = round(length)
    while first + count * length > len(stretch.position) + LATE_SAMPLES + WHOLE_SAMPLES:
        count -= 1
    if count < 2:
        return None
    at = first + (np.arange(count)[:, None] + np.arange(samples) / samples) * length
    knots = np.arange(len(stretch.position))

    def onto(values: Array | None) -> Array | None:
        if values is None:
            return None
        whole = np.isfinite(values).all(axis=0)
        result = np.full((count, samples, values.shape[1]), np.nan)
        if whole.any():
            result[..., whole] = make_interp_spline(knots, values[:, whole], k=SPLINE_DEGREE)(at)
        return result

    left = np.clip(np.floor(at).astype(int), 0, len(knots) - 2)
    return Periods(
        rate_hz=stretch.rate_hz * samples / length,
        position=make_interp_spline(knots, stretch.position, k=SPLINE_DEGREE)(at),
        torque=make_interp_spline(knots, stretch.torque, k=SPLINE_DEGREE)(at),
        measured=stretch.measured[left] & stretch.measured[left + 1] & (at <= knots[-1] + WHOLE_SAMPLES)[..., None],
        rows=(first, min(int(np.ceil(first + count * length)), len(knots))),
        start_s=stretch.start_s + first / stretch.rate_hz,
        velocity=onto(stretch.velocity),
        acceleration=onto(stretch.acceleration),
    )


def _lag(position: Array) -> float:
    """Samples by which each period lies behind the one before, where they lie best on one another (one Newton step)."""
    mean = position.mean(axis=0)
    speed = np.gradient(mean, axis=0)
    speed -= speed.mean(axis=0)
    difference = (position[-1] - position[0]) / (len(position) - 1)
    width = np.maximum(_scatter(position), 1e-6 * np.ptp(mean, axis=0))
    moves = width > LEAST_WIDTH  # a joint that stands still says nothing of the lag
    precision = np.where(moves, 1.0, 0.0) / np.where(moves, width, 1.0) ** 2
    energy = float((precision * (speed**2).sum(axis=0)).sum())
    # A period that began late shows the motion of an earlier phase: q_k(φ) = q(φ - lag), hence the sign.
    return -float((precision * (speed * difference).sum(axis=0)).sum()) / energy if energy > 0.0 else 0.0


def _scatter(position: Array) -> Array:
    """Standard deviation of what differs between periods about their own means, (n,)."""
    own = position - position.mean(axis=1, keepdims=True)
    return (own - own.mean(axis=0)).std(axis=(0, 1))
