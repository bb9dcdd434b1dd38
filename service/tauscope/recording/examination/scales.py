"""Typical figures of a recording, from windows of it: by them a sample is judged, in memory that does not grow."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Recording
from tauscope.recording.samples import Array, Samples
from tauscope.robot.robot import JointType, Robot

BLOCK_ROWS = 1 << 15  # rows that are read at once
WINDOWS = 8
WINDOW_ROWS = 1 << 13  # rows of one window; a recording of at most `WINDOWS` of them is looked at whole
RANKED_ROWS = 4096  # rows of which a percentile is taken
BUNCHED = 0.1  # share of the usual interval below which two stamps belong to one instant: a buffer was emptied
BURST = 0.1  # share of the mean step below which the usual step is one within a burst, as buffers are emptied


@dataclass(frozen=True, eq=False)
class Sketch:
    """Windows spread over a recording."""

    windows: tuple[Samples, ...]

    @staticmethod
    def of(recording: Recording) -> "Sketch":
        """The windows of a recording."""
        count = len(recording)
        if count <= WINDOWS * WINDOW_ROWS:
            return Sketch((recording.samples(),))
        starts = np.linspace(0, count - WINDOW_ROWS, WINDOWS).astype(int)
        return Sketch(tuple(recording.samples(int(start), int(start) + WINDOW_ROWS) for start in starts))

    @cached_property
    def _steps(self) -> Array:
        return np.concatenate([np.diff(window.time) for window in self.windows])

    @cached_property
    def interval(self) -> float:
        """Usual time from row to row [s]: the median, or where rows come in bursts the mean without gaps."""
        return self._mean_step if self.has_bursts else float(np.median(self._steps))

    @cached_property
    def has_bursts(self) -> bool:
        """Whether the source always sends in bursts: the conditioning counts its rows."""
        return bool(np.median(self._steps) < BURST * self._mean_step)

    @cached_property
    def _mean_step(self) -> float:
        """Mean time from row to row without gaps [s]."""
        return float(np.mean(self._steps[self._steps <= np.percentile(self._steps, 99.0)]))

    @cached_property
    def position(self) -> Array:
        """Positions of all windows, (N, n)."""
        return np.concatenate([window.position for window in self.windows])

    @cached_property
    def effort(self) -> Array:
        """Efforts of all windows, (N, n)."""
        return np.concatenate([window.effort for window in self.windows])

    @cached_property
    def velocity(self) -> Array | None:
        """Recorded velocity of the rows of `slope`, (N, n)."""
        given = [window.velocity[1:-1] for window in self.windows if window.velocity is not None]
        return np.concatenate(given) if given else None

    @cached_property
    def slope(self) -> Array:
        """Δq/Δt over two steps about every inner row of the windows, NaN within bursts, (N, n)."""
        parts = []
        for window in self.windows:
            elapsed = window.time[2:] - window.time[:-2]
            elapsed = np.where(elapsed > self.interval, elapsed, np.nan)
            parts.append((window.position[2:] - window.position[:-2]) / elapsed[:, None])
        return np.concatenate(parts)

    @cached_property
    def effort_at_slope(self) -> Array:
        """Effort of the rows of `slope`, (N, n)."""
        return np.concatenate([window.effort[1:-1] for window in self.windows])

    @cached_property
    def top_speed(self) -> Array:
        """Largest |Δq/Δt| of every joint, (n,) [rad/s or m/s]; 0 where it is not known."""
        return np.fmax.reduce(np.abs(self.slope), axis=0, initial=0.0)

    @cached_property
    def reach(self) -> Array:
        """99th percentile of |q| of every joint, (n,) [rad or m]; 0 where it is not known. Spikes reach beyond."""
        return percentile(np.abs(self.position), 99.0)

    @cached_property
    def span(self) -> Array:
        """Range of every joint's position, (n,) [rad or m]; 0 where it is not known."""
        low = np.fmin.reduce(self.position, axis=0, initial=np.inf)
        high = np.fmax.reduce(self.position, axis=0, initial=-np.inf)
        return np.maximum(high - low, 0.0)


def joint_types(recording: Recording, robot: Robot | None) -> list[JointType]:
    """Types of the joints, revolute where no robot says otherwise."""
    return [JointType.REVOLUTE] * recording.joint_count if robot is None else [joint.type for joint in robot.joints]


def percentile(values: Array, share: float) -> Array:
    """Percentile of the finite `values` (N, n) of every column, (n,); 0 where there are none."""
    few = values[:: max(1, len(values) // RANKED_ROWS)]
    known = [column[np.isfinite(column)] for column in few.T]
    return np.array([float(np.percentile(column, share)) if len(column) else 0.0 for column in known])


ONE_TURN = 2.0 * np.pi

TURN_SPARE = 0.01  # beyond one turn by this, an angle is not wrapped [rad]
LARGEST_STEP = np.pi / 2.0  # turn between two samples up to which it can be told which way [rad]
# A value that moves by so many of its own steps in one row is sampled too coarsely to rest in the next.
STEPS_OF_A_MOVE = 4.0
HELD_SHARE = 0.5  # share of such moves followed by a rest above which the source holds its values
FEWEST_MOVES = 30  # least number of such moves: noise makes some now and then
LONGEST_HOLD = 64  # rows of the longest hold: a source of 30 Hz on a topic of 2 kHz
JUDGED_ROWS = 2048  # rows whose neighbours are looked at for a typical size
NEIGHBOURS = 3  # rows on either side that a row is judged by


@dataclass(frozen=True)
class PositionScale:
    """Typical steps of one joint's position."""

    is_wrapped: bool
    step: float  # encoder's step, or the least noise [rad or m]
    move: float  # 95th percentile of the change from row to row, while the joint moves [rad or m]
    surprise: float  # 90th percentile of the change beyond what the neighbours foretell, while it moves [rad or m]
    hold: int  # rows for which the source holds a value; 1 where it does not


@dataclass(frozen=True)
class EffortScale:
    """Typical steps of one joint's effort, in its own unit. `low`, `high`: 1st and 99th percentile."""

    low: float
    high: float
    span: float  # from the 5th to the 95th percentile
    change: float  # 90th percentile of the change from row to row
    surprise: float  # 95th percentile of the distance beyond the range of the neighbours
    run: int  # 99th percentile of the rows for which a value is repeated
    hold: int


def measure_positions(sketch: Sketch, types: list[JointType]) -> list[PositionScale]:
    """Scales of every joint's position."""
    scales = []
    for joint, kind in enumerate(types):
        pieces = [
            _leave_stops_out(window.time, window.position[:, joint], sketch.interval) for window in sketch.windows
        ]
        values = sketch.position[:, joint]
        values = values[np.isfinite(values)]
        low, high = np.percentile(values, [0.1, 99.9]) if len(values) else (0.0, 0.0)
        wrapped = kind is JointType.REVOLUTE and np.pi < high - low < ONE_TURN + TURN_SPARE
        step, _, hold = _measure_holds(pieces)
        if hold > 1:
            pieces = [piece[is_new(piece)] for piece in pieces]
        steps = np.concatenate([unwrap_steps(np.diff(piece), is_wrapped=wrapped) for piece in pieces])
        moves = np.abs(steps) > step / 2.0
        surprises = np.abs(steps - neighbours_median(steps))
        move, surprise = _percentile(np.abs(steps[moves]), 95.0), _percentile(surprises[moves], 90.0)
        scales.append(PositionScale(bool(wrapped), step, move, surprise, hold))
    return scales


def measure_efforts(sketch: Sketch) -> list[EffortScale]:
    """Scales of every joint's effort."""
    scales = []
    for values in sketch.effort.T:
        known = values[np.isfinite(values)]
        if len(known) <= NEIGHBOURS:
            scales.append(EffortScale(0.0, 0.0, 0.0, 0.0, 0.0, 1, 1))
            continue
        _, run, hold = _measure_holds([known])
        changes = np.abs(np.diff(known))
        low, lower, upper, high = (float(value) for value in np.percentile(known, [1.0, 5.0, 95.0, 99.0]))
        seen = known[is_new(known)] if hold > 1 else known
        beyond = distance_beyond(neighbour_windows(seen)[:: max(1, len(seen) // JUDGED_ROWS)])
        change, surprise = _percentile(changes[changes > 0.0], 90.0), _percentile(beyond, 95.0)
        scales.append(EffortScale(low, high, upper - lower, change, surprise, run, hold))
    return scales


def unwrap_steps(steps: Array, *, is_wrapped: bool) -> Array:
    """Steps of an angle without the turn that a wrap adds. `steps`: (N,), changes from row to row [rad]."""
    if not is_wrapped:
        return steps
    is_wrap = np.abs(np.abs(steps) - ONE_TURN) < LARGEST_STEP  # two turns at once are a spike
    return steps - ONE_TURN * np.sign(steps) * is_wrap


def is_new(values: Array) -> NDArray[np.bool_]:
    """Whether a value is another than the one before, (N,). `values`: (N,), a signal."""
    return np.diff(values, prepend=np.nan) != 0.0


def neighbours_median(values: Array) -> Array:
    """Median of the seven values around each one, (N,); the ends are repeated. `values`: (N,), a signal."""
    from scipy.ndimage import median_filter  # slow to import, and a control process reads no recordings

    return median_filter(values, size=2 * NEIGHBOURS + 1, mode="nearest")


def neighbour_windows(values: Array) -> Array:
    """Each value with its neighbours, (N, 7), mirrored at the ends. `values`: (N,), a signal."""
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, NEIGHBOURS, mode="reflect"), 2 * NEIGHBOURS + 1)


def distance_beyond(windows: Array) -> Array:
    """Distance of the middle of `windows`, (N, 7), beyond the others less their two extremes, (N,); 0 within."""
    values = windows[:, NEIGHBOURS]
    others = np.sort(np.delete(windows, NEIGHBOURS, axis=1), axis=1)
    return np.maximum(np.maximum(values - others[:, -2], others[:, 1] - values), 0.0)


def _leave_stops_out(time: Array, values: Array, interval: float) -> Array:
    known = np.isfinite(values)
    time, values = time[known], values[known]
    return values[np.diff(time, prepend=-np.inf) > 0.1 * interval]


def _measure_holds(pieces: list[Array]) -> tuple[float, int, int]:
    """Least step of some signals, usual length of a run of one value, and rows of a zero-order hold."""
    steps, lengths = [], []
    for values in pieces:
        changes = np.flatnonzero(np.diff(values) != 0.0) + 1
        if len(changes) > 1:
            steps.append(np.abs(values[changes] - values[changes - 1]))
            lengths.append(np.diff(changes))
    if not steps:
        return 0.0, max((len(values) for values in pieces), default=1), 1
    step = float(np.percentile(np.concatenate(steps), 1.0))
    bold = [sizes >= STEPS_OF_A_MOVE * step for sizes in steps]
    moves = np.concatenate([runs[large[:-1] & large[1:]] for runs, large in zip(lengths, bold, strict=True)])
    usual = int(np.percentile(np.concatenate(lengths), 99.0))
    if len(moves) < FEWEST_MOVES or np.mean(moves > 1) < HELD_SHARE:
        return step, usual, 1
    hold = int(np.median(moves))
    return step, usual, hold if hold <= LONGEST_HOLD else 1


def _percentile(values: Array, share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else 0.0
