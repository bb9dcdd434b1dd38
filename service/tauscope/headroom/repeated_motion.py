"""Recordings of one and the same motion: they differ by noise alone, whatever a model lacks."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar
from scipy.signal import correlate

from tauscope.headroom.motion_rows import MotionRows
from tauscope.recording.recording import Array

SAME = 0.02
"""Rms difference of every joint's positions, relative to their spread, up to which two motions are the same: what a
model leaves changes by no more than that part of itself."""

LEAST_OVERLAP = 0.5
"""Part of the shorter recording that must be the same."""

FEWEST_ROWS = 100
"""Rows that two recordings must share: the rms of their difference is then known to 10 %."""


def noise_between(motions: Sequence[MotionRows]) -> Array:
    """Rms of what recordings of the same motion differ by, over √2, (n,) [Nm or N]; NaN where none repeats another."""
    joints = len(motions[0].torque)
    energy, count = np.zeros(joints), np.zeros(joints)
    for one, other in combinations(motions, 2):
        for difference, known in _differences(one, other):
            energy += 0.5 * np.sum(np.where(known, difference, 0.0) ** 2, axis=1)
            count += known.sum(axis=1)
    return np.where(count >= FEWEST_ROWS, np.sqrt(energy / np.maximum(count, 1.0)), np.nan)


def _differences(one: MotionRows, other: MotionRows) -> Iterator[tuple[Array, NDArray[np.bool_]]]:
    """What is left of the torque of the same motion, (n, L), and where both were measured; nothing where it differs."""
    steps = [float(np.median(np.diff(each.time))) for each in (one, other)]
    fewest = max(int(LEAST_OVERLAP * min(len(one.time), len(other.time))), FEWEST_ROWS)
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
