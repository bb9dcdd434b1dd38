"""Motion of a recording in the band in which torque of commands is compared with torque of bodies."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from tauscope.recording.conditioning.filters import smooth
from tauscope.recording.recording import Recording
from tauscope.recording.samples import Array, Samples

# Longest delay that is looked for [s]: buses of servos take 1 to 50 ms, a teleoperation loop up to 150 ms.
LONGEST_S = 0.2

# Band of the comparison [Hz]: loops of servos pass no more, and above it steps of an encoder outweigh torque.
BAND_HZ = 10.0
MOST_ROWS = 20_000  # rows of a recording that are compared
REST = 0.02  # speed relative to the fastest below which friction has no direction


@dataclass(frozen=True, eq=False)
class SmoothMotion:
    """Motion on a uniform grid."""

    samples: Samples
    time: Array  # (N,) [s]
    position: Array  # (N, n), q; as are q̇, q̈
    velocity: Array
    acceleration: Array
    rate: float  # of sampling [Hz]
    band: float  # of the comparison [Hz]

    @staticmethod
    def of(recording: Recording) -> "SmoothMotion":
        """The motion of a recording."""
        samples = recording.samples(0, MOST_ROWS)
        rate = 1.0 / float(np.median(np.diff(samples.time)))
        band = min(BAND_HZ, 0.2 * rate)
        time = np.arange(samples.time[0], samples.time[-1], 1.0 / rate)
        raw = np.stack([put_onto(samples.time, column, time) for column in samples.position.T], axis=1)
        position = smooth(raw, rate, 2.0 * band)
        velocity = np.gradient(position, 1.0 / rate, axis=0)
        acceleration = np.gradient(velocity, 1.0 / rate, axis=0)
        return SmoothMotion(samples, time, position, velocity, acceleration, rate, band)

    @property
    def independent(self) -> float:
        """Independent rows a row of the band."""
        return 2.0 * self.band / self.rate

    def onto(self, values: Array) -> Array:
        """`values`, (M,), one a row of the recording, NaN where missed, on the grid, (N,)."""
        return put_onto(self.samples.time, values, self.time)

    def moves(self, joint: int) -> NDArray[np.bool_]:
        """Rows in which a joint moves, and every delay has a command, (N,); not those the filter mixes with rest."""
        speed = np.abs(self.velocity[:, joint])
        reach = 2 * int(0.5 * self.rate / self.band) + 1
        moving = binary_erosion(speed > REST * speed.max(), [True] * reach, border_value=1)
        moving[: int(LONGEST_S * self.rate) + 1] = False
        return moving

    def reduce(self, columns: Array, joint: int) -> Array:
        """`columns`, (N, k), and a joint's friction and constant, in the band, where it moves: (M, k + 3)."""
        speed = self.velocity[:, joint]
        whole = np.column_stack([columns, speed, np.sign(speed), np.ones(len(speed))])
        return smooth(whole, self.rate, self.band)[self.moves(joint)]


def put_onto(time: Array, values: Array, at: Array, missing: float = 0.0) -> Array:
    """`values`, (M,) at `time`, (M,), at instants `at`, (N,); missed ones are bridged, `missing` where all are."""
    known = np.isfinite(values)
    return np.interp(at, time[known], values[known]) if known.any() else np.full(len(at), missing)
