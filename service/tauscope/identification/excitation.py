"""What the recordings excite, and what held-out motion asks for beyond it."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tauscope.identification.dataset import PreparedMotion
from tauscope.recording.recording import Array

TURNING = 0.05  # share of a joint's top speed that it passes on both sides of a reversal: less is noise at rest
TOP = 0.99  # share of the samples that are slower than the top speed


MOST_SAMPLES = 2048  # samples of one piece of motion, which has up to 32,768, by which it is described


@dataclass(frozen=True, eq=False)
class Excitation:
    """How the joints move. `lowest`, `highest`: (n,), positions [rad or m]."""

    lowest: Array
    highest: Array
    speed: Array  # (n,), top speed, which one sample in a hundred exceeds [rad/s or m/s]
    reversals: np.ndarray  # (n,) int, how often the joints turn round


def measure_excitation(motions: Iterable[PreparedMotion]) -> Excitation:
    """Ranges, speeds and reversals of all motions together."""
    pieces = [(thin(prepared.motion.position), thin(prepared.motion.velocity)) for prepared in motions]
    speed = np.quantile(np.abs(np.concatenate([velocity for _, velocity in pieces])), TOP, axis=0)
    return Excitation(
        np.min([position.min(axis=0) for position, _ in pieces], axis=0),
        np.max([position.max(axis=0) for position, _ in pieces], axis=0),
        speed,
        np.sum([_count_reversals(velocity, TURNING * speed) for _, velocity in pieces], axis=0),
    )


def thin(signals: Array, most: int = MOST_SAMPLES) -> Array:
    """Every so many rows of `signals`, (N, n), so that a long recording is not held in memory."""
    return signals[:: -(-len(signals) // most)].copy()


def _count_reversals(velocity: Array, threshold: Array) -> np.ndarray:
    counts = []
    for column, least in zip(velocity.T, threshold, strict=True):
        moving = column[np.abs(column) > least]
        counts.append(int(np.count_nonzero(np.diff(np.sign(moving)))))
    return np.array(counts)
