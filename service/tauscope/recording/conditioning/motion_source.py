"""Whether a recorded velocity or acceleration may stand in for the derivative of the positions, joint by joint.

Drives often log a velocity that is lagged, filtered, or nothing but the positions' own difference. It is used only
where two things hold. It is *consistent*: in the band that the positions allow it equals q̇, in gain, in delay and
without an offset. And it is *quieter*: its noise is its own, not the positions' noise once more, and less of it reaches
q̈, so that the band may be wider.

In acceleration, where the fast part of the motion weighs most: q̈_recorded = g q̈ - d q⃛ + noise, fitted by least squares
to signals smoothed alike; g is the gain and d the delay.

A short recording at a low rate shows neither so well in acceleration. There the same is fitted to velocity, and the
delay to all joints together, for one driver reports them all. A velocity that passes is used in bands in which its
noise reaches q̈ less than the positions' noise does.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from tauscope.recording.conditioning.filters import DIFFERENCE_MARGIN, derivative, smooth, smoothing_margin
from tauscope.recording.conditioning.position_noise import (
    PLATEAU,
    TINY,
    AccelerationSpectrum,
    PositionNoise,
    acceleration_spectrum,
)
from tauscope.recording.conditioning.uniform import Stretch
from tauscope.recording.recording import Array

GAIN_TOLERANCE = 0.01  # largest error of the recorded signal's gain
# Largest phase [rad] by which the recorded signal may lag or lead at the edge of the band that it would open.
PHASE_TOLERANCE = 0.02
DELAY_TOLERANCE = 0.25  # largest delay, in sample intervals
OFFSET_TOLERANCE = 0.01  # largest offset, relative to the rms of the signal
MISFIT_TOLERANCE = 0.02  # largest rms of what neither gain, delay nor noise explains, relative to q̈
# Least share of the positions' noise that must show in the difference between the two: where it does not, the recorded
# signal carries that same noise and was made from the positions.
OWN_NOISE = 0.5
# A measurement's noise is white; where the lower half of its plateau lies this much over the upper one, it was
# filtered, and its plateau tells nothing about its band.
FLATNESS = 2.0
# Largest standard error of a gain, and largest offset, that is fitted to velocity: beyond the band of the positions
# their own noise is more.
RESOLVED = 0.03
WORTHWHILE = 1.25  # least widening of the band for which another source is used
CLEAR_PART = 0.5  # part of the positions' band in which gain and delay are compared
WIDEST = 3.0  # multiple of the positions' band up to which another source widens it: that far its phase can be foretold
LOWER_PLATEAU = (0.35, 0.6)


class Source(StrEnum):
    """What a joint's q̇ and q̈ are made from."""

    POSITION = "position"
    VELOCITY = "recorded velocity"
    ACCELERATION = "recorded acceleration"


@dataclass(frozen=True, eq=False)
class MotionSource:
    """What every joint's motion is made from, and the band that it stands."""

    velocity: np.ndarray  # (n,), whether the recorded signal is used for q̇
    acceleration: np.ndarray  # (n,), whether the recorded signal is used for q̈
    limits_hz: Array  # (n,), widest band in which q̈ keeps to `NOISE_SHARE`; infinite where it does everywhere
    # (n,), band from which on the recorded velocity is the quieter source; infinite: never
    quieter_from_hz: Array | None = None

    def in_band(self, cutoff_hz: float | None) -> "MotionSource":
        """The sources of a band. `cutoff_hz`: of the common band [Hz]; None for no filter."""
        if self.quieter_from_hz is None:
            return self
        band = np.inf if cutoff_hz is None else cutoff_hz
        quieter = np.isfinite(self.quieter_from_hz) & (band >= self.quieter_from_hz)
        return replace(self, velocity=self.velocity | (quieter & ~self.acceleration))

    @property
    def names(self) -> tuple[Source, ...]:
        """Per joint, the source of its q̈."""
        return tuple(
            Source.ACCELERATION if acceleration else Source.VELOCITY if velocity else Source.POSITION
            for velocity, acceleration in zip(self.velocity, self.acceleration, strict=True)
        )


def choose_sources(stretches: Sequence[Stretch], noise: PositionNoise) -> MotionSource:
    """The quieter of consistent sources, joint by joint."""
    joint_count = stretches[0].position.shape[1]
    limits = noise.joint_limits_hz.copy()
    best = limits.copy()
    chosen = np.zeros((2, joint_count), dtype=bool)
    for order, used in ((1, chosen[0]), (0, chosen[1])):
        for joint in range(joint_count):
            pieces = _whole_pieces(stretches, joint, order)
            if not pieces or not np.isfinite(limits[joint]):
                continue
            rate = stretches[0].rate_hz
            limit = float(noise.joint_limits_hz[joint])
            wider = _wider_band(pieces, order, rate, float(noise.density[joint]), limit)
            if wider is not None and wider > WORTHWHILE * best[joint]:
                best[joint], used[joint] = wider, True
                limits[joint] = min(wider, WIDEST * limit)
    return MotionSource(chosen[0], chosen[1], limits, _quieter_bands(stretches, noise))


def _whole_pieces(stretches: Sequence[Stretch], joint: int, order: int) -> list[tuple[Array, Array]]:
    """Positions, and recorded velocity (order 1) or acceleration (0), of stretches where none is missing."""
    recorded = [stretch.velocity if order else stretch.acceleration for stretch in stretches]
    return [
        (stretch.position[:, joint], values[:, joint])
        for stretch, values in zip(stretches, recorded, strict=True)
        if values is not None and np.isfinite(values[:, joint]).all()
    ]


def _quieter_bands(stretches: Sequence[Stretch], noise: PositionNoise) -> Array | None:
    """Band from which on each joint's recorded velocity is the quieter source, (n,) [Hz]; None without velocities.

    Noise of density S in q leaves ω⁵ S / 5 in q̈ up to ω, noise of q̇ leaves ω³ S / 3.
    """
    joint_count, rate = stretches[0].position.shape[1], stretches[0].rate_hz
    bands, fits = np.full(joint_count, np.inf), []
    for joint in range(joint_count):
        limit = float(noise.joint_limits_hz[joint])
        pieces = _whole_pieces(stretches, joint, 1)
        fit = _fit_velocity(pieces, rate, limit) if pieces and np.isfinite(limit) else None
        if fit is None:
            continue
        fits.append(fit)
        spectrum = acceleration_spectrum([values[:, None] for _, values in pieces], rate, 1)
        density, expected = float(spectrum.density[0]), float(noise.density[joint])
        # A velocity that was made from the positions carries their noise, too.
        is_own = fit.misfit**2 >= OWN_NOISE * expected * _noise_gain(rate, fit.band_hz, 1)
        if fit.is_alike and expected > 0.0 and _is_flat(spectrum, rate) and is_own:
            bands[joint] = max(np.sqrt(5.0 * density / (3.0 * expected)) / (2.0 * np.pi), limit)
    if not fits:
        return None
    weight = np.array([fit.delay_std for fit in fits]) ** -2.0
    delay = abs(float(np.sum(weight * [fit.delay for fit in fits]) / weight.sum())) + float(weight.sum() ** -0.5)
    return bands if delay <= DELAY_TOLERANCE / rate else None


@dataclass(frozen=True)
class _Fit:
    """x_recorded = g x - d ẋ + offset, x by the positions, in their band."""

    gain: float
    gain_std: float
    delay: float
    delay_std: float
    offset: float  # relative to the rms of the recorded signal
    misfit: float  # rms of the rest
    motion: float  # rms of x
    band_hz: float

    @staticmethod
    def solve(
        matrix: Array, target: Array, rate_hz: float, band_hz: float, offset: float | None = None
    ) -> "_Fit | None":
        """Least squares of `matrix` (N, 2 or 3), x, ẋ and ones; None where the motion tells nothing."""
        scale = np.sqrt(np.mean(matrix**2, axis=0))
        if not (scale > 0.0).all() or not target.any() or np.linalg.matrix_rank(matrix / scale) < matrix.shape[1]:
            return None
        solution, *_ = np.linalg.lstsq(matrix / scale, target, rcond=None)
        misfit = float(np.sqrt(np.mean((target - matrix / scale @ solution) ** 2)))
        independent = max(1.0, len(target) * 2.0 * band_hz / rate_hz)
        inverse = np.linalg.pinv((matrix / scale).T @ (matrix / scale) * (independent / len(target)))
        std = np.maximum(misfit, TINY) * np.sqrt(np.maximum(np.diag(inverse), 0.0)) / scale
        gain, delay, *constant = solution / scale
        return _Fit(
            gain=float(gain),
            gain_std=float(std[0]),
            delay=float(-delay),
            delay_std=max(float(std[1]), TINY),
            offset=float(constant[0] / np.sqrt(np.mean(target**2))) if offset is None else offset,
            misfit=misfit,
            motion=float(scale[0]),
            band_hz=band_hz,
        )

    @property
    def is_alike(self) -> bool:
        """Whether gain and offset are those of the positions' own velocity, as far as is known well enough."""
        return (
            abs(self.gain - 1.0) <= GAIN_TOLERANCE + 2.0 * self.gain_std
            and self.gain_std <= RESOLVED
            and abs(self.offset) <= RESOLVED
        )

    def is_consistent(self, band_hz: float, interval_s: float) -> bool:
        """Whether gain and delay, with their standard errors, and offset keep to the tolerances in a band."""
        delay = abs(self.delay) + self.delay_std
        return bool(
            abs(self.gain - 1.0) + self.gain_std <= GAIN_TOLERANCE
            and delay <= DELAY_TOLERANCE * interval_s
            and 2.0 * np.pi * band_hz * delay <= PHASE_TOLERANCE
            and abs(self.offset) <= OFFSET_TOLERANCE
        )


def _fit_velocity(pieces: Sequence[tuple[Array, Array]], rate_hz: float, limit_hz: float) -> _Fit | None:
    """Fit the recorded velocity to the positions' own; None where too little of the motion is left."""
    margin = smoothing_margin(rate_hz, limit_hz) + 2 * DIFFERENCE_MARGIN
    columns, targets = [], []
    for position, recorded in pieces:
        if len(position) < 3 * margin:
            continue
        inner = slice(margin, -margin)
        velocity = derivative(smooth(position[:, None], rate_hz, limit_hz), rate_hz)
        acceleration = derivative(velocity, rate_hz)
        columns.append(np.hstack([velocity[inner], acceleration[inner], np.ones_like(velocity[inner])]))
        targets.append(smooth(recorded[:, None], rate_hz, limit_hz)[inner, 0])
    if not columns:
        return None
    return _Fit.solve(np.concatenate(columns), np.concatenate(targets), rate_hz, limit_hz)


def _wider_band(
    pieces: Sequence[tuple[Array, Array]], order: int, rate_hz: float, density: float, limit_hz: float
) -> float | None:
    """The band [Hz] that the noise of a signal, `order` differences below q̈, allows; None where it is doubtful."""
    spectrum = acceleration_spectrum([values[:, None] for _, values in pieces], rate_hz, order)
    if not _is_flat(spectrum, rate_hz):
        return None
    wider = float(spectrum.widest_band(rate_hz)[0])
    # Gain and delay show where the motion is; the noise at the edge of the positions' band would only blur them.
    inside = _compare(pieces, order, rate_hz, CLEAR_PART * limit_hz)
    comparison = _compare(pieces, order, rate_hz, limit_hz)
    if inside is None or comparison is None or not inside.is_consistent(min(wider, WIDEST * limit_hz), 1.0 / rate_hz):
        return None
    expected = density * _noise_gain(rate_hz, limit_hz, 2)
    own = float(spectrum.density[0]) * _noise_gain(rate_hz, limit_hz, order)
    explained = (MISFIT_TOLERANCE * comparison.motion) ** 2 + 2.0 * (expected + own)
    is_its_own = comparison.misfit**2 >= OWN_NOISE * expected
    return wider if is_its_own and comparison.misfit**2 <= explained else None


def _is_flat(spectrum: AccelerationSpectrum, rate_hz: float) -> bool:
    """Whether the signal's noise is as strong in the lower part of its plateau as in the upper."""
    part = spectrum.frequency * 2.0 / rate_hz
    lower, upper = ((part >= low) & (part <= high) for low, high in (LOWER_PLATEAU, PLATEAU))
    levels = [np.median(spectrum.power[band, 0] / spectrum.gain[band]) for band in (lower, upper)]
    return bool(levels[0] <= FLATNESS * levels[1])


def _compare(pieces: Sequence[tuple[Array, Array]], order: int, rate_hz: float, limit_hz: float) -> _Fit | None:
    """Fit the recorded signal to the derivatives of the positions; None where too little of the motion is left."""
    margin = smoothing_margin(rate_hz, limit_hz) + 3 * DIFFERENCE_MARGIN
    columns, targets, offsets, squares, count = [], [], 0.0, 0.0, 0
    for position, recorded in pieces:
        if len(position) < 3 * margin:
            continue
        inner = slice(margin, -margin)
        series = [smooth(position[:, None], rate_hz, limit_hz)]
        for _ in range(3):
            series.append(derivative(series[-1], rate_hz))
        target = smooth(recorded[:, None], rate_hz, limit_hz)
        plain = target[inner, 0] - series[2 - order][inner, 0]
        offsets += plain.sum()
        squares += float(np.sum(target[inner, 0] ** 2))
        count += len(plain)
        for _ in range(order):
            target = derivative(target, rate_hz)
        columns.append(np.hstack([values[inner] for values in series[2:]]))
        targets.append(target[inner, 0])
    if not columns:
        return None
    rms = np.sqrt(squares / count)
    offset = float(offsets / count / rms) if rms > 0.0 else np.inf
    return _Fit.solve(np.concatenate(columns), np.concatenate(targets), rate_hz, limit_hz, offset)


def _noise_gain(rate_hz: float, limit_hz: float, order: int) -> float:
    """∫ ω^(2·order) |H|² df of the smoothing at `limit_hz`: variance in q̈ for each unit of a signal's noise density."""
    frequency = np.linspace(0.0, rate_hz / 2.0, 4097)
    response = 1.0 / (1.0 + (frequency / limit_hz) ** 8)
    return float(np.trapezoid((2.0 * np.pi * frequency) ** (2 * order) * response**2, frequency))
