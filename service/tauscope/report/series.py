"""Measured and predicted torque over time: conditioned again, as for the estimate, but only as much as a page shows."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np
from numpy.typing import NDArray

from tauscope.identification import Identification
from tauscope.identification.dataset import Dataset, PreparedMotion
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array


def envelope_indices(values: Array, most: int) -> NDArray[np.intp]:
    """Samples that keep a curve's look: the least and the greatest of each of most/2 equal buckets, in order of time.

    No peak is lost. NaN are passed over, but a bucket that holds nothing else keeps one of them, so that the gap shows.

    `values`: (N,), the curve. Returns (M,) intp, increasing indices, M ≤ max(most, 2).
    """
    count = len(values)
    if count <= most:
        return np.arange(count)
    edges = np.linspace(0, count, max(most // 2, 1) + 1).astype(np.intp)
    kept: list[int] = []
    for start, stop in pairwise(edges):
        bucket = values[start:stop]
        if np.isnan(bucket).all():
            kept.append(int(start))
        else:
            kept += sorted({int(start + np.nanargmin(bucket)), int(start + np.nanargmax(bucket))})
    return np.array(kept, dtype=np.intp)


MOST_SERIES = 6  # recordings that the friction curves are compared with
MOST_PIECES = 8  # pieces of a recording that are conditioned in search of the longest


@dataclass(frozen=True, eq=False)
class TorqueSeries:
    """One continuous piece of a recording beside what the model says."""

    recording: str
    repetitions: int
    rate_hz: float
    time: Array  # (N,) [s]
    velocity: Array  # (N, n), smoothed q̇ [rad/s or m/s]
    measured: Array  # (N, n), measured torque, NaN where none was measured [Nm or N]
    predicted: Array  # (N, n), torque of the model [Nm or N]

    @property
    def residual(self) -> Array:
        """Measured less predicted torque, (N, n) [Nm or N]."""
        return self.measured - self.predicted


def torque_series(identification: Identification, recording: Recording) -> TorqueSeries:
    """The longest of the first pieces of a recording, with the delivered model's torque."""
    longest = max(islice(_pieces(identification, recording), MOST_PIECES), key=lambda piece: len(piece.motion.time))
    motion = longest.motion
    return TorqueSeries(
        recording=recording.name,
        repetitions=motion.repetitions,
        rate_hz=motion.rate_hz,
        time=motion.time,
        velocity=motion.velocity,
        measured=np.where(motion.measured[0], motion.torque[0], np.nan),
        predicted=longest.predict_torque(identification.structure, identification.parameters[None])[0].T,
    )


def _pieces(identification: Identification, recording: Recording) -> Iterator[PreparedMotion]:
    conditioner = Conditioner.survey(recording, identification.robot)
    structure = identification.structure
    return iter(Dataset([conditioner], identification.robot, structure.base, identification.cutoff_hz))
