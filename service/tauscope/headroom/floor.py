"""The noise of every joint's rows, that no model predicts, and how it is known."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar
from scipy.signal import correlate

from tauscope.diagnosis import Diagnosis
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import full_torque
from tauscope.diagnosis.noise.floor import FEWEST_ROWS, repeated_differences
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.period_pairs import rounding_repeats
from tauscope.headroom.motion_rows import MotionRows
from tauscope.recording.conditioning.common_band import Decimator
from tauscope.recording.recording import Array

SAME = 0.02
"""Rms difference of every joint's positions, relative to their spread, up to which two motions are the same: what a
model leaves changes by no more than that part of itself."""

LEAST_OVERLAP = 0.5  # part of the shorter recording that must be the same
FEWEST_SHARED = 100  # rows that two recordings must share: the rms of their difference is then known to 10 %


def noise_between(motions: Sequence[MotionRows]) -> Array:
    """Rms of what recordings of the same motion differ by, over √2, (n,) [Nm or N]; NaN where none repeats another."""
    joints = len(motions[0].torque)
    energy, count = np.zeros(joints), np.zeros(joints)
    for one, other in combinations(motions, 2):
        for difference, known in _differences(one, other):
            energy += 0.5 * np.sum(np.where(known, difference, 0.0) ** 2, axis=1)
            count += known.sum(axis=1)
    return np.where(count >= FEWEST_SHARED, np.sqrt(energy / np.maximum(count, 1.0)), np.nan)


def _differences(one: MotionRows, other: MotionRows) -> Iterator[tuple[Array, NDArray[np.bool_]]]:
    """What is left of the torque of the same motion, (n, L), and where both were measured; nothing where it differs."""
    steps = [float(np.median(np.diff(each.time))) for each in (one, other)]
    fewest = max(int(LEAST_OVERLAP * min(len(one.time), len(other.time))), FEWEST_SHARED)
    if min(len(one.time), len(other.time)) < fewest or abs(steps[0] / steps[1] - 1.0) > 1e-3:
        return
    spread = one.position.std(axis=1)
    moving = spread > SAME * spread.max()
    own, others = (each.position[moving] / spread[moving, None] for each in (one, other))
    lag = _likeliest_lag(own, others, fewest)
    path = CubicSpline(np.arange(others.shape[1]), others, axis=1)
    rows = np.arange(max(0, 1 - lag), min(own.shape[1], others.shape[1] - lag - 1))
    best = minimize_scalar(
        lambda shift: float(np.mean((path(rows + shift) - own[:, rows]) ** 2)), bounds=(lag - 1.0, lag + 1.0)
    )
    if np.sqrt(np.mean((path(rows + best.x) - own[:, rows]) ** 2, axis=1)).max() > SAME:
        return
    left = CubicSpline(np.arange(others.shape[1]), other.torque - other.explained, axis=1)(rows + best.x)
    near = np.round(rows + best.x).astype(np.intp)
    yield left - (one.torque - one.explained)[:, rows], one.used[:, rows] & other.used[:, near]


def _likeliest_lag(own: Array, others: Array, fewest: int) -> int:
    """Rows that the second motion is later, by the least mean square of the difference: Σ a² + Σ b² - 2 Σ a b."""
    lags = np.arange(-(own.shape[1] - fewest), others.shape[1] - fewest + 1)
    first, last = np.maximum(0, -lags), np.minimum(own.shape[1], others.shape[1] - lags)
    sums = [np.append(0.0, np.cumsum(np.sum(each**2, axis=0))) for each in (own, others)]
    squares = sums[0][last] - sums[0][first] + sums[1][last + lags] - sums[1][first + lags]
    crossed = sum(correlate(b, a) for a, b in zip(own, others, strict=True))
    products = np.asarray(crossed)[lags + own.shape[1] - 1]
    return int(lags[np.argmin((squares - 2.0 * products) / (last - first))])


FloorKind = Literal["repetitions", "high_frequency", "none"]

STOP_BAND = 1.5  # frequencies from which the band's filter passes nothing, relative to its cut-off
OPEN = 0.9  # …and up to which a recording's own anti-aliasing passes all, relative to its Nyquist frequency
FEWEST_FREQUENCIES = 16  # frequencies between the two that a density is told by
SEGMENT_S = 2.0  # length of a segment of Welch's method [s]


@dataclass(frozen=True)
class NoiseFloor:
    """Rms of noise in the common band [Nm or N]; None where neither repetitions nor noise above the band tell it."""

    rms: float | None
    kind: FloorKind


def noise_floors(diagnosis: Diagnosis, motions: Sequence[MotionRows]) -> list[NoiseFloor]:
    """The floor of every joint: by repeated periods, by recordings of the same motion, or by noise above the band."""
    observations = diagnosis.fitter.observations
    model = diagnosis.selection.fit.model
    known: list[tuple[FloorKind, Array]] = [
        ("repetitions", noise_between_periods(observations, model)),
        ("repetitions", noise_between(motions)),
        ("high_frequency", noise_above_band(observations, model, diagnosis.cutoff_hz)),
    ]
    floors = []
    for joint in range(len(known[0][1])):
        told = (NoiseFloor(float(rms[joint]), kind) for kind, rms in known if np.isfinite(rms[joint]))
        floors.append(next(told, NoiseFloor(None, "none")))
    return floors


def noise_between_periods(observations: Observations, model: ExtendedModel) -> Array:
    """Rms of what periods of a recording differ by, (n,) [Nm or N]; NaN where too few repeat."""
    joints = observations.robot.joint_count
    energy, count = np.zeros(joints), np.zeros(joints)
    if not rounding_repeats(observations):
        for rows, used, factor in repeated_differences(observations, model):
            energy += factor * np.sum(np.where(used, rows, 0.0) ** 2, axis=1)
            count += used.sum(axis=1)
    return np.where(count >= FEWEST_ROWS, np.sqrt(energy / np.maximum(count, 1.0)), np.nan)


def noise_above_band(observations: Observations, model: ExtendedModel, cutoff_hz: float) -> Array:
    """Rms in the band of white noise of the density above it, (n,) [Nm or N]; NaN where the band is open."""
    joints = observations.robot.joint_count
    power, weight = np.zeros(joints), 0.0
    for piece in observations:
        motion = piece.prepared.motion
        band = motion.band
        if not isinstance(band, Decimator):
            continue
        length = min(round(SEGMENT_S * motion.rate_hz), len(motion.time))
        left = np.where(motion.measured[0].T, motion.torque[0].T - full_torque(model, piece), 0.0)
        frequency, density = signal.welch(left, motion.rate_hz, nperseg=length, axis=-1)
        above = (frequency > STOP_BAND * cutoff_hz) & (frequency < OPEN * motion.rate_hz / 2.0)
        if above.sum() < FEWEST_FREQUENCIES:
            continue
        # σ² of a sample is density × f_s/2; the filter leaves Σ h² of it. The median: a resonance is no noise.
        white = np.median(density[:, above], axis=1) * motion.rate_hz / 2.0 * float(band.kernel @ band.kernel)
        power += white * len(motion.time)
        weight += len(motion.time)
    return np.sqrt(power / weight) if weight else np.full(joints, np.nan)
