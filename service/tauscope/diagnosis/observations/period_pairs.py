"""Periods beside those that follow them: what differs between the two is no part of the motion that repeats."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tauscope.diagnosis.observations.observations import Observations, Piece
from tauscope.recording.recording import Array

# Part of the noise of a joint's velocity that must differ between periods: where the motion repeats to the sample, an
# encoder rounds alike in each, and what that makes of the model's columns does not show between them.
REPEATED_NOISE = 0.4
STANDING = 10.0  # largest velocity of a joint that stands, in standard deviations of its noise
FEWEST_SAMPLES = 64  # samples of a difference between periods below which it tells nothing


@dataclass(frozen=True)
class PeriodPair:
    """Samples of all periods but the last of a run, and those a period later, between two samples each."""

    earlier: slice
    near: slice
    far: slice
    part: float

    def later(self, values: Array) -> Array:
        """Signals a period later, (k, L). `values`: (k, N), signals of the piece at all its samples."""
        return (1.0 - self.part) * values[:, self.near] + self.part * values[:, self.far]

    @property
    def factor(self) -> float:
        """What turns the power of a difference into the noise's."""
        return 1.0 / (1.0 + self.part**2 + (1.0 - self.part) ** 2)


def period_pairs(observations: Observations, piece: Piece) -> Iterator[PeriodPair]:
    """The repeated parts of a piece."""
    number, motion = piece.prepared.recording, piece.prepared.motion
    runs = observations.repetitions[number] if 0 <= number < len(observations.repetitions) else ()
    for run in runs:
        instants, half = piece.time[0], 0.5 / motion.rate_hz
        first = int(np.searchsorted(instants, run.start_s - half))
        stop = int(np.searchsorted(instants, run.start_s + (run.count - 1) * run.length_s - half))
        shift = run.length_s * motion.rate_hz
        whole = int(np.floor(shift + 1e-6))
        stop = min(stop, len(motion.velocity) - whole - 1)
        if run.count > 1 and stop - first >= FEWEST_SAMPLES:
            near, far = (slice(first + whole + step, stop + whole + step) for step in (0, 1))
            yield PeriodPair(slice(first, stop), near, far, float(np.clip(shift - whole, 0.0, 1.0)))


def rounding_repeats(observations: Observations) -> bool:
    """Whether the positions' noise is the same in every period at some joint that moves."""
    for piece in observations:
        velocity = piece.prepared.motion.velocity.T
        moves = np.abs(velocity).max(axis=1) > STANDING * piece.velocity_std
        for pair in period_pairs(observations, piece):
            change = pair.later(velocity) - velocity[:, pair.earlier]
            differing = np.sqrt(np.mean(change**2, axis=1) * pair.factor)
            if (moves & (differing < REPEATED_NOISE * piece.velocity_std)).any():
                return True
    return False
