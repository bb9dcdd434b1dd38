"""What recordings must show before anything is estimated from them: motion, and motion that an arm can make."""

from collections.abc import Sequence

import numpy as np

from tauscope.errors import IdentificationError
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Samples

FASTEST = 1e4
"""A median speed above this is a mistake of units [rad/s or m/s]."""


def require_motion(conditioners: Sequence[Conditioner]) -> None:
    """Refuse recordings in which no joint leaves the noise of its own encoder, or one moves as nothing can.

    Raises
    ------
    IdentificationError
        names the recordings, or the recording and the joint
    """
    for conditioner in conditioners:
        for samples in conditioner.usable_samples():
            _require_plausible_speed(conditioner, samples)
    if not any(conditioner.moving.any() for conditioner in conditioners):
        names = ", ".join(conditioner.recording.name for conditioner in conditioners)
        raise IdentificationError(
            f"{names}: no joint moves by more than the noise of its position: record a motion that excites every joint"
        )


def _require_plausible_speed(conditioner: Conditioner, samples: Samples) -> None:
    """Refuse speeds that no joint reaches: time stamps or positions are in another unit."""
    complete = samples.complete
    if complete.sum() < 2:
        return
    speed = np.abs(np.diff(samples.position[complete], axis=0)) / np.diff(samples.time[complete])[:, None]
    if np.count_nonzero(speed > FASTEST) < len(speed) / 2:
        return  # no median can exceed it: spares a short recording the sorting
    typical = np.median(speed, axis=0)
    joint = int(np.argmax(typical))
    if typical[joint] > FASTEST:
        name = conditioner.robot.joints[joint].name
        raise IdentificationError(
            f"{conditioner.recording.name}: {name} (column q{joint + 1}) moves at {typical[joint]:.3g} per second most"
            " of the time: is column t in seconds, and q in rad or m?"
        )
