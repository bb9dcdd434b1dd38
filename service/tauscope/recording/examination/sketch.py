"""Windows of a recording from which typical figures are taken, in memory that does not grow with its length."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tauscope.recording.recording import Recording
from tauscope.recording.samples import Array, Samples
from tauscope.robot.robot import JointType, Robot

BLOCK_ROWS = 1 << 15  # rows that are read at once
WINDOWS = 8
WINDOW_ROWS = 1 << 13  # rows of one window; a recording of at most `WINDOWS` of them is looked at whole
RANKED_ROWS = 4096  # rows of which a percentile is taken
BURST = 0.1  # share of the mean step below which the usual step is one within a burst, as buffers are emptied
BREAK = 2.5  # steps of the clock above this many medians are gaps, across which nothing is differenced


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
        """Times from row to row, (N,) [s]."""
        return np.concatenate([np.diff(window.time) for window in self.windows])

    @cached_property
    def longest_interval(self) -> float:
        """Longest usual time from row to row [s]: their 99th percentile."""
        return float(np.percentile(self._steps, 99.0))

    @cached_property
    def interval(self) -> float:
        """Usual time from row to row [s]: the median, or where rows come in bursts the mean without gaps."""
        median = float(np.median(self._steps))
        mean = float(np.mean(self._steps[self._steps <= self.longest_interval]))
        return mean if median < BURST * mean else median

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
        """Δq/Δt over two steps about every inner row of the windows, NaN across gaps, (N, n)."""
        parts = []
        for window in self.windows:
            elapsed = window.time[2:] - window.time[:-2]
            elapsed = np.where((elapsed > self.interval) & (elapsed < 2.0 * BREAK * self.interval), elapsed, np.nan)
            parts.append((window.position[2:] - window.position[:-2]) / elapsed[:, None])
        return np.concatenate(parts)

    @cached_property
    def effort_at_slope(self) -> Array:
        """Effort of the rows of `slope`, (N, n)."""
        return np.concatenate([window.effort[1:-1] for window in self.windows])

    @cached_property
    def position_at_slope(self) -> Array:
        """Position of the rows of `slope`, (N, n)."""
        return np.concatenate([window.position[1:-1] for window in self.windows])

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
    """Percentile of every column's finite values, (n,); 0 where there are none.

    `values`: (N, n), columns; `share`: percentile, 0 to 100.
    """
    few = values[:: max(1, len(values) // RANKED_ROWS)]
    known = [column[np.isfinite(column)] for column in few.T]
    return np.array([float(np.percentile(column, share)) if len(column) else 0.0 for column in known])
