"""From time stamps to uniform, gap-free stretches of motion, with what was never measured marked as such.

Drive logs jitter, miss samples and pause. Filters need a uniform grid, statistics must not count what was filled in.
So short gaps are bridged and *masked*, long gaps split the recording, and both are counted.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from service.errors import RecordingError
from service.recording.recording import Array, Recording
from service.robot.robot import Robot

Mask = NDArray[np.bool_]

SCAN_ROWS = 1 << 17
"""Rows read at once while looking for gaps."""

WINDOW_ROWS = 1 << 15
"""Rows conditioned at once: bounds memory whatever the recording's length."""

BRIDGED_SAMPLES = 5.5
BRIDGED_SECONDS = 0.0125
"""A gap is bridged up to the longer of the two: an arm moves along a cubic that long, not longer."""

UNIFORM_TOLERANCE = 0.02
"""Largest deviation of a stamp from the uniform grid, in sample intervals, that is not worth resampling."""

SHORTEST_STRETCH = 32
"""Samples below which a stretch between two long gaps cannot be filtered and is left out (and counted)."""


@dataclass(frozen=True, eq=False)
class Timing:
    """How a recording was sampled.

    rate_hz : float
        the inverse of the median interval
    rows : tuple of (int, int)
        row ranges without a long gap, each at least `SHORTEST_STRETCH` rows
    samples, missed, dropped : int
        rows in the file; rows without a complete position; rows in stretches too short to use
    gaps : int
        number of long gaps, at which the recording was split
    """

    rate_hz: float
    rows: tuple[tuple[int, int], ...]
    samples: int
    missed: int
    dropped: int
    gaps: int


@dataclass(frozen=True, eq=False)
class Stretch:
    """Uniformly sampled motion without a long gap.

    start_s, rate_hz : float
        time of the first sample, sampling rate
    position, torque : (N, n) float64
        q [rad or m] and joint torque τ [Nm or N]; finite everywhere
    measured : (N, n) bool
        False where a joint's torque was filled in and must not be counted
    period : (N,) float64 or None
        index of the repeated period, NaN outside
    resampled : bool
        the stamps were not uniform enough and both signals were interpolated
    """

    start_s: float
    rate_hz: float
    position: Array
    torque: Array
    measured: Mask
    period: Array | None
    resampled: bool


def find_stretches(recording: Recording) -> Timing:
    """Row ranges of `recording` that can be filtered in one go.

    Parameters
    ----------
    recording : Recording
        the recording; read once, in pieces

    Returns
    -------
    Timing
        the sampling rate, the ranges, and what is missing

    Raises
    ------
    RecordingError
        where no stretch is long enough to be used
    """
    times, rows = [], []
    for start in range(0, len(recording), SCAN_ROWS):
        samples = recording.samples(start, min(start + SCAN_ROWS, len(recording)))
        complete = np.flatnonzero(np.isfinite(samples.position).all(axis=1))
        times.append(samples.time[complete])
        rows.append(complete + start)
    time, row = np.concatenate(times), np.concatenate(rows)
    if len(time) < SHORTEST_STRETCH:
        raise RecordingError(
            f"{recording.name}: only {len(time)} rows have a position for every joint; at least {SHORTEST_STRETCH} are"
            " needed: check which q columns are empty"
        )
    interval = np.diff(time)
    typical = float(np.median(interval))
    breaks = np.flatnonzero(interval > max(BRIDGED_SAMPLES * typical, BRIDGED_SECONDS)) + 1
    edges = np.concatenate([[0], breaks, [len(time)]])
    ranges = [(int(row[a]), int(row[b - 1]) + 1, int(b - a)) for a, b in zip(edges[:-1], edges[1:], strict=True)]
    kept = tuple((start, stop) for start, stop, count in ranges if count >= SHORTEST_STRETCH)
    if not kept:
        raise RecordingError(
            f"{recording.name}: broken by {len(breaks)} gaps into pieces of fewer than {SHORTEST_STRETCH} samples:"
            " record again, or check column t"
        )
    dropped = sum(count for _, _, count in ranges if count < SHORTEST_STRETCH)
    return Timing(1.0 / typical, kept, len(recording), len(recording) - len(time), dropped, len(breaks))


def read_stretch(recording: Recording, robot: Robot, start: int, stop: int, rate_hz: float) -> Stretch:
    """Rows start:stop on a uniform grid.

    Parameters
    ----------
    recording : Recording
        the recording
    robot : Robot
        gives sign and torque constant of every joint
    start, stop : int
        a row range of `find_stretches`, or a part of one
    rate_hz : float
        sampling rate of the grid [Hz]

    Returns
    -------
    Stretch
        the motion; positions follow a cubic spline between samples, torques a straight line
    """
    samples = recording.samples(start, stop)
    torque = recording.joint_torque(samples.effort, robot)
    complete = np.isfinite(samples.position).all(axis=1)
    time, position, torque = samples.time[complete], samples.position[complete], torque[complete]
    period = None if samples.period is None else samples.period[complete]
    index = (time - time[0]) * rate_hz
    nearest = np.rint(index)
    drift = np.polyfit(nearest, index, 1) if len(index) > 1 else np.array([1.0, 0.0])
    if np.abs(index - np.polyval(drift, nearest)).max() <= UNIFORM_TOLERANCE:
        return _on_own_grid(time, nearest.astype(int), rate_hz / drift[0], position, torque, period)
    return _resampled(time, rate_hz, position, torque, period)


def windows(start: int, stop: int, margin: int) -> Iterator[tuple[int, int]]:
    """Overlapping row windows that cover start:stop, each losing `margin` rows at both of its ends.

    Parameters
    ----------
    start, stop : int
        row range of one stretch
    margin : int
        rows that filters cannot use at either end of a window

    Yields
    ------
    tuple of (int, int)
        first and one-past-last row; a recording that fits into one window is never cut
    """
    step = max(WINDOW_ROWS - 2 * margin, SHORTEST_STRETCH)
    first = start
    while True:
        last = min(first + step + 2 * margin, stop)
        if stop - last < step // 2:
            last = stop
        yield first, last
        if last == stop:
            return
        first += step


def _on_own_grid(
    time: Array, index: NDArray[np.int_], rate_hz: float, position: Array, torque: Array, period: Array | None
) -> Stretch:
    """The samples as they are, missing grid points filled in and masked."""
    count = int(index[-1]) + 1
    if count == len(index):
        filled, measured = _filled(torque)
        return Stretch(float(time[0]), rate_hz, position, filled, measured, period, resampled=False)
    grid = np.arange(count)
    spread = np.full((count, torque.shape[1]), np.nan)
    spread[index] = torque
    filled, measured = _filled(spread)
    return Stretch(
        float(time[0]),
        rate_hz,
        make_interp_spline(index, position, k=3)(grid),
        filled,
        measured,
        None if period is None else period[np.searchsorted(index, grid, side="right") - 1],
        resampled=False,
    )


def _resampled(time: Array, rate_hz: float, position: Array, torque: Array, period: Array | None) -> Stretch:
    """The samples interpolated onto a uniform grid; a point inside a gap or beside a missed torque is masked."""
    count = int(np.floor((time[-1] - time[0]) * rate_hz)) + 1
    grid = time[0] + np.arange(count) / rate_hz
    left = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, len(time) - 2)
    near = (time[left + 1] - time[left]) * rate_hz < 2.5
    finite = np.isfinite(torque)
    filled, _ = _filled(torque)
    interpolated = np.stack([np.interp(grid, time, column) for column in filled.T], axis=1)
    return Stretch(
        float(time[0]),
        rate_hz,
        make_interp_spline(time, position, k=3)(grid),
        interpolated,
        near[:, None] & finite[left] & finite[left + 1],
        None if period is None else period[left],
        resampled=True,
    )


def _filled(torque: Array) -> tuple[Array, Mask]:
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
