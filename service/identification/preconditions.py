"""What recordings must show before anything is estimated from them: motion, and motion that an arm can make."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from service.errors import IdentificationError
from service.recording.conditioning import Conditioner
from service.recording.recording import Array, Samples

SCAN_ROWS = 1 << 16

STANDING_STILL = 10.0
SMALLEST_MOTION = 1e-5
"""A joint moves where its range exceeds so many standard deviations of its noise, and this [rad or m]."""

FASTEST = 1e4
"""A median speed above this is a mistake of units [rad/s or m/s]."""


def moving_joints(conditioner: Conditioner) -> NDArray[np.bool_]:
    """Joints that leave the noise of their own encoder at some time of a recording, (n,).

    Parameters
    ----------
    conditioner : Conditioner
        the surveyed recording
    """
    noise = np.sqrt(conditioner.noise.density * conditioner.timing.rate_hz / 2.0)
    lowest, highest = np.full(len(noise), np.inf), np.full(len(noise), -np.inf)
    for samples in _samples(conditioner):
        lowest = np.fmin(lowest, np.nanmin(samples.position, axis=0))
        highest = np.fmax(highest, np.nanmax(samples.position, axis=0))
    return highest - lowest > np.maximum(STANDING_STILL * noise, SMALLEST_MOTION)


def require_motion(conditioners: Sequence[Conditioner]) -> None:
    """Refuse recordings in which no joint leaves the noise of its own encoder, or one moves as nothing can.

    Parameters
    ----------
    conditioners : sequence of Conditioner
        the surveyed recordings

    Raises
    ------
    IdentificationError
        names the recordings, or the recording and the joint
    """
    for conditioner in conditioners:
        for samples in _samples(conditioner):
            _require_plausible_speed(conditioner, samples.time, samples.position)
    if not any(moving_joints(conditioner).any() for conditioner in conditioners):
        names = ", ".join(conditioner.recording.name for conditioner in conditioners)
        raise IdentificationError(
            f"{names}: no joint moves by more than the noise of its position: record a motion that excites every joint"
        )


def _samples(conditioner: Conditioner) -> Iterator[Samples]:
    """The usable rows of a recording, piece by piece."""
    for start, stop in conditioner.timing.rows:
        for first in range(start, stop, SCAN_ROWS):
            yield conditioner.recording.samples(first, min(first + SCAN_ROWS, stop))


def _require_plausible_speed(conditioner: Conditioner, time: Array, position: Array) -> None:
    """Refuse speeds that no joint reaches: time stamps or positions are in another unit."""
    complete = np.isfinite(position).all(axis=1)
    if complete.sum() < 2:
        return
    speed = np.abs(np.diff(position[complete], axis=0) / np.diff(time[complete])[:, None])
    typical = np.median(speed, axis=0)
    joint = int(np.argmax(typical))
    if typical[joint] > FASTEST:
        name = conditioner.robot.joints[joint].name
        raise IdentificationError(
            f"{conditioner.recording.name}: {name} (column q{joint + 1}) moves at {typical[joint]:.3g} per second most"
            " of the time: is column t in seconds, and q in rad or m?"
        )
