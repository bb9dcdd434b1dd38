"""One piece of motion with the torque of two models: all that a black box is given of a recording and a diagnosis."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class MotionRows:
    """Evenly spaced rows of one piece of motion, in the band in which models and torque are compared."""

    recording: int  # number of the recording
    time: Array  # (M,), since the beginning of the recording [s]
    progress: Array  # (M,), part of the recording's motion that is over, 0 to 1; alike in every repetition of a motion
    position: Array  # (n, M), q; as are q̇, q̈ [SI]
    velocity: Array
    acceleration: Array
    load: Array  # (n, M), rigid-body torque [Nm or N]
    torque: Array  # (n, M), measured [Nm or N]
    plain: Array  # (n, M), by the nominal model
    explained: Array  # (n, M), by the model with all findings
    used: NDArray[np.bool_]  # (n, M), rows that rest on measured torque


@dataclass(frozen=True, eq=False)
class Inputs:
    """Rows by the columns that a black box learns from."""

    columns: Array  # (R, d), those of the joint itself first
    own: int  # how many these are

    def at(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> "Inputs":
        """Some of the rows. `rows`: (R,) or (k,) int, mask or places."""
        return Inputs(self.columns[rows], self.own)


def joint_inputs(motion: MotionRows, joint: int) -> Inputs:
    """Rows of a black box: q, q̇, q̈, load, also one row earlier and later, of all joints, and travel."""
    order = [joint, *(other for other in range(len(motion.position)) if other != joint)]
    now = (motion.position, motion.velocity, motion.acceleration, motion.load)
    beside = [shifted(values, step) for values in now[1:3] for step in (-1, 1)]
    travel = travel_since_reversal(motion.position[joint], motion.velocity[joint])
    own, *others = (np.stack([values[each] for values in (*now, *beside)]) for each in order)
    return Inputs(np.concatenate([own, travel[None], *others]).T, len(own) + 1)


def shifted(values: Array, step: int) -> Array:
    """Signals some rows later, the row at the end repeated, (n, M). `values`: (n, M), evenly spaced rows."""
    places = np.clip(np.arange(values.shape[-1]) + step, 0, values.shape[-1] - 1)
    return values[..., places]


def travel_since_reversal(position: Array, velocity: Array) -> Array:
    """Way since `velocity`, (M,), last changed its sign, with that sign, (M,); `position`: (M,)."""
    turns = np.flatnonzero(np.diff(np.signbit(velocity), prepend=np.signbit(velocity[:1])))
    last = np.searchsorted(turns, np.arange(len(position)), side="right")
    return position - position[np.append(0, turns)[last]]
