"""From time stamps to uniform, gap-free stretches of motion, with what was never measured marked as such.

Drive logs jitter, miss samples and pause. Filters need a uniform grid, statistics must not count what was filled in.
So short gaps are bridged and *masked*; long gaps have split the recording before (`timing`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from tauscope.recording.conditioning.timing import Timing
from tauscope.recording.recording import Array, Recording
from tauscope.robot.robot import Robot

Mask = NDArray[np.bool_]

# Largest deviation of a stamp from the uniform grid, in sample intervals, that is not worth resampling.
UNIFORM_TOLERANCE = 0.02
# Stamps rounded to so many decimals or fewer are recognised: they may be off the grid by half their last digit.
STAMP_DECIMALS = 5
# Samples in a row that a recorded velocity or acceleration may lack without being given up for the stretch.
BRIDGED_VALUES = 2
NEARBY = 0.75  # a grid point further than this, in sample intervals, from every sample was not measured


@dataclass(frozen=True, eq=False)
class Stretch:
    """Uniformly sampled motion without a long gap."""

    start_s: float
    rate_hz: float
    position: Array  # (N, n), q [rad or m], finite everywhere
    torque: Array  # (N, n), joint torque τ [Nm or N], finite everywhere
    measured: Mask  # (N, n), False where a joint's torque was filled in and must not be counted
    period: Array | None  # (N,), index of the excitation period plus the part of it that is over; NaN outside
    resampled: bool
    velocity: Array | None = None  # (N, n), recorded qd; NaN for a joint of which more than single samples were missed
    acceleration: Array | None = None  # (N, n), recorded qdd, as `velocity`


@dataclass(frozen=True, eq=False)
class Grid:
    """Where the samples lie on a uniform grid."""

    index: NDArray[np.int_]  # (N,) int, grid point of every sample
    start_s: float  # instant of grid point 0, relative to the first sample [s]
    rate_hz: float


def read_stretch(recording: Recording, robot: Robot, start: int, stop: int, timing: Timing) -> Stretch:
    """Rows start:stop on a uniform grid."""
    samples = recording.samples(start, stop)
    torque = recording.joint_torque(samples.effort, robot)
    complete = samples.complete
    rows = slice(None) if complete.all() else complete
    time = samples.time[rows]
    elapsed = time - time[0]
    groups = [None if group is None else _bridge(group[rows]) for group in (samples.velocity, samples.acceleration)]
    grid = uniform_grid(elapsed, timing.rate_hz)
    if grid is None:
        rate, begin = timing.rate_hz, 0.0
        at = np.arange(int(elapsed[-1] * rate + UNIFORM_TOLERANCE) + 1) / rate
        onto = _spline(elapsed, at)
        filled, measured = _resample_torque(elapsed, at, rate, torque[rows], onto)
    else:
        rate, begin = grid.rate_hz, grid.start_s
        at = grid.start_s + np.arange(int(grid.index[-1]) + 1) / rate
        onto = _same if len(at) == len(elapsed) else _spline(grid.index, np.arange(len(at)))
        filled, measured = _fill(_spread(torque[rows], grid.index, len(at)))
    return Stretch(
        start_s=float(time[0] + begin),
        rate_hz=rate,
        position=onto(samples.position[rows]),
        torque=filled,
        measured=measured,
        period=timing.progress(float(time[0]), at),
        resampled=grid is None,
        velocity=None if groups[0] is None else onto(groups[0]),
        acceleration=None if groups[1] is None else onto(groups[1]),
    )


def uniform_grid(elapsed: Array, rate_hz: float) -> Grid | None:
    """The uniform grid of stamps `elapsed`, (N,) since the first; None where they are off by `UNIFORM_TOLERANCE`."""
    tolerance = UNIFORM_TOLERANCE + 0.5 * _last_digit(elapsed) * rate_hz
    fits = [_fit_grid(index, elapsed, rate_hz) for index in _possible_indices(elapsed * rate_hz)]
    good = [(grid, deviation) for grid, deviation in fits if deviation <= tolerance]
    if not good:
        return None
    return min(good, key=lambda fit: fit[1])[0]


def _possible_indices(position: Array) -> list[NDArray[np.int_]]:
    """Grid points that the samples may have: none missed, the nearest ones, or as the intervals tell."""
    everything = np.arange(len(position))
    steps = np.maximum(np.rint(np.diff(position)), 1.0)
    if (steps == 1.0).all():
        return [everything]
    nearest = np.rint(position).astype(int)
    counted = np.concatenate([[0], np.cumsum(steps)]).astype(int)
    return [everything, counted, *([nearest] if (np.diff(nearest) > 0).all() else [])]


def _fit_grid(index: NDArray[np.int_], elapsed: Array, rate_hz: float) -> tuple[Grid, float]:
    """The grid for one numbering of the samples, and the largest deviation of a stamp from it [intervals]."""
    position = elapsed * rate_hz
    deviation = position - index
    slope = 1.0
    if np.ptp(deviation) > 2.0 * UNIFORM_TOLERANCE and len(index) > 2:
        slope = float(np.polyfit(index, position, 1)[0])
        deviation = position - slope * index
    middle = float(deviation.max() + deviation.min()) / 2.0
    return Grid(index, middle / rate_hz, rate_hz / slope), float(np.ptp(deviation)) / 2.0


def _last_digit(elapsed: Array) -> float:
    """Value of the last decimal of all stamps [s]; zero where they have more than `STAMP_DECIMALS`."""
    for decimals in range(STAMP_DECIMALS + 1):
        scaled = elapsed * 10.0**decimals
        if np.abs(scaled - np.rint(scaled)).max() < 0.05:  # epoch seconds are exact to 2e-7 only
            return 10.0**-decimals
    return 0.0


def _bridge(values: Array) -> Array:
    """Signals in which single samples were missed, up to `BRIDGED_VALUES` in a row, bridged by straight lines."""
    missed = np.isnan(values)
    if not missed.any():
        return values
    bridged = values.copy()
    everywhere = np.arange(len(values))
    for joint in np.flatnonzero(missed.any(axis=0)):
        gaps = np.flatnonzero(np.diff(missed[:, joint], prepend=False, append=False)).reshape(-1, 2)
        inside = (gaps[:, 0] > 0) & (gaps[:, 1] < len(values)) & (gaps[:, 1] - gaps[:, 0] <= BRIDGED_VALUES)
        if inside.all():
            known = ~missed[:, joint]
            bridged[:, joint] = np.interp(everywhere, everywhere[known], values[known, joint])
    return bridged


def _same(values: Array) -> Array:
    """Samples that already lie on the grid; a joint of which one is missing is NaN throughout."""
    missed = np.isnan(values, order="F").any(axis=0)
    return np.where(missed, np.nan, values) if missed.any() else values


def _spline(knots: Array | NDArray[np.int_], at: Array | NDArray[np.int_]) -> Callable[[Array], Array]:
    """Cubic spline through the samples, evaluated on the grid; a joint of which one is missing is NaN throughout."""

    def onto(values: Array) -> Array:
        whole = np.isfinite(values).all(axis=0)
        result = np.full((len(at), values.shape[1]), np.nan)
        if whole.any():
            result[:, whole] = make_interp_spline(knots, values[:, whole], k=min(3, len(knots) - 1))(at)
        return result

    return onto


def _spread(values: Array, index: NDArray[np.int_], count: int) -> Array:
    if count == len(index):
        return values
    spread = np.full((count, values.shape[1]), np.nan)
    spread[index] = values
    return spread


def _resample_torque(
    time: Array, at: Array, rate_hz: float, torque: Array, onto: Callable[[Array], Array]
) -> tuple[Array, Mask]:
    """Torque on the grid, and where it rests on samples close by on both sides."""
    left = np.clip(np.searchsorted(time, at, side="right") - 1, 0, max(len(time) - 2, 0))
    right = np.minimum(left + 1, len(time) - 1)
    nearby = np.minimum(np.abs(at - time[left]), np.abs(time[right] - at)) * rate_hz <= NEARBY
    filled, finite = _fill(torque)
    return onto(filled), nearby[:, None] & finite[left] & finite[right]


def _fill(torque: Array) -> tuple[Array, Mask]:
    """Torque with NaN bridged by straight lines, and where it was measured; a joint never measured becomes zero."""
    measured = np.isfinite(torque)
    if measured.all():
        return torque, measured
    filled = torque.copy()
    everywhere = np.arange(len(torque))
    for joint in range(torque.shape[1]):
        known = measured[:, joint]
        filled[:, joint] = np.interp(everywhere, everywhere[known], torque[known, joint]) if known.any() else 0.0
    return filled, measured
