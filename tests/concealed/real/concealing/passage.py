"""A recording as the concealing laws see it: motion of a wider band than the torque is compared in."""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from concealed.real.concealing.recorded_sets import recordings_in
from tauscope.recording import Recording, read_recording
from tauscope.robot import Robot

Array = NDArray[np.float64]

MOTION_BANDS = 3.0
"""Motion is smoothed at this multiple of the set's band: the step of friction stays sharp within the band."""

GRID_BANDS = 8.0
"""Columns are made at this multiple of the band [samples/s per Hz]: over twice the band of the motion."""

ROW_BANDS = 2.5
"""Rows that are compared, per second and Hz of the band: hardly more than twice, as neighbours tell the same."""

ENDS = 3.0
"""A filter begins so many periods of its corner before the values, on their mirror image."""

LARGEST_SHARE = 0.4
"""A filter's corner is at most this share of the sampling rate."""


@dataclass(frozen=True, eq=False)
class Passage:
    """One recording.

    recording : Recording
        as it was read
    time : (N,) float64
        from its first sample on [s]
    position, velocity, acceleration : (N, n) float64
        smoothed without delay
    torque : (N, n) float64
        joint torque as recorded [Nm or N]
    gain : (n,) float64
        joint torque per unit of recorded effort
    """

    recording: Recording
    held_out: bool
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    gain: Array

    @property
    def rate_hz(self) -> float:
        """Median sampling rate."""
        return 1.0 / float(np.median(np.diff(self.time)))

    def with_torque(self, torque: Array) -> "Passage":
        """The same motion under another torque."""
        return replace(self, torque=torque)


def passages_of(folder: Path, robot: Robot, band_hz: float) -> list[Passage]:
    """All recordings of a folder, training ones first."""
    return [
        passage_of(read_recording(path), robot, band_hz, held_out=path.name.startswith("held-out"))
        for path in recordings_in(folder)
    ]


def passage_of(recording: Recording, robot: Robot, band_hz: float, *, held_out: bool = False) -> Passage:
    """One recording with its motion."""
    told = recording.samples()
    time = told.time - told.time[0]
    even = even_grid(time)
    position = low_pass(onto(even, time, told.position), 1.0 / even[1], MOTION_BANDS * band_hz)
    velocity = np.gradient(position, even[1], axis=0)
    acceleration = np.gradient(velocity, even[1], axis=0)
    gain = recording.joint_torque(np.ones((1, robot.joint_count)), robot)[0]
    q, qd, qdd = (onto(time, even, each) for each in (position, velocity, acceleration))
    return Passage(recording, held_out, time, q, qd, qdd, told.effort * gain, gain)


def even_grid(time: Array, rate_hz: float | None = None) -> Array:
    """Even instants over a recording, at its own median rate or at no more than another one."""
    step = float(np.median(np.diff(time)))
    if rate_hz is not None:
        step = max(step, 1.0 / rate_hz)
    return np.asarray(step * np.arange(int(time[-1] / step) + 1), np.float64)


def onto(target: Array, time: Array, values: Array) -> Array:
    """Values (N, n) at other instants, by straight lines."""
    return np.column_stack([np.interp(target, time, each) for each in values.T])


def low_pass(values: Array, rate_hz: float, corner_hz: float) -> Array:
    """Values (N, …) filtered without delay: Butterworth of fourth order, forwards and backwards."""
    sections = _sections(rate_hz, min(corner_hz, LARGEST_SHARE * rate_hz))
    ends = min(len(values) - 1, int(ENDS * rate_hz / corner_hz) + 1)
    return np.asarray(signal.sosfiltfilt(sections, values, axis=0, padlen=ends))


@lru_cache
def _sections(rate_hz: float, corner_hz: float) -> Array:
    return np.asarray(signal.butter(4, corner_hz, fs=rate_hz, output="sos"))


def with_effort(recording: Recording, effort: Array, kept: slice = slice(None)) -> Recording:
    """The same recording with other efforts, or a stretch of it."""
    told = recording.samples()
    rest = {
        name: None if (values := getattr(told, name)) is None else values[kept]
        for name in ("velocity", "acceleration", "reference", "temperature", "link_position", "period")
    }
    return Recording.from_arrays(
        recording.name,
        told.time[kept],
        told.position[kept],
        effort[kept],
        effort_kind=recording.effort_kind,
        **rest,
    )


@dataclass(frozen=True, eq=False)
class Grid:
    """Where columns are made of a passage, and which of its instants are compared.

    time : (M,) float64
        even instants [s]
    rows : (R,) int
        those that are compared: beyond the filter's ends, no two alike
    """

    time: Array
    rows: NDArray[np.intp]
    band_hz: float

    @property
    def rate_hz(self) -> float:
        return 1.0 / float(self.time[1])

    @staticmethod
    def of(passage: Passage, band_hz: float) -> "Grid":
        time = even_grid(passage.time, GRID_BANDS * band_hz)
        rate = 1.0 / float(time[1])
        every, edge = max(1, int(rate / (ROW_BANDS * band_hz))), int(np.ceil(rate / band_hz))
        return Grid(time, np.arange(edge, len(time) - edge, every), band_hz)

    def smoothed(self, passage: Passage, values: Array) -> Array:
        """Recorded values (N, n) at the instants of the grid, in the band of the motion."""
        even = even_grid(passage.time)
        return onto(
            self.time, even, low_pass(onto(even, passage.time, values), 1.0 / even[1], MOTION_BANDS * self.band_hz)
        )

    def compared(self, values: Array) -> Array:
        """Values (M, …) of the grid in the band, at the rows that are compared."""
        return low_pass(values, self.rate_hz, self.band_hz)[self.rows]
