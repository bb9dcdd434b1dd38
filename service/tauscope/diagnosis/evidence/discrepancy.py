"""Physics of no catalogue: torque that is smooth in a joint's speed, in its position, or in both.

A Gaussian process of unit length on motion that is scaled to its range, by random Fourier features (Rahimi & Recht
2007): √(2/b) cos(ω·z + φ) with ω normal. Direction of motion is a coordinate of its own, so that each direction may
have its own curve. What the nominal model can say itself is taken out of the features (Plumlee 2017): else they would
take the links' torque from the links.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations
from tauscope.recording.recording import Array

# Which of position, speed and direction each kind of discrepancy depends on: speed, position, both.
COORDINATES = np.array([[0.0, 1.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
FEATURES = (24, 24, 60)  # features of each kind
LENGTH = 1.0 / 1.5  # length over which the torque changes, relative to half the range of motion
# Slope at which the direction turns, at most, relative to the top speed: no corner is sharper than the motion.
SHARPEST = 20.0
DIRECTION = 1e-6  # singular values of the scaled columns below this share of the largest are no direction
STANDING = float(np.finfo(float).eps)  # half range and top speed of a joint that stands, which none has
GROUP = np.repeat(np.arange(len(FEATURES)), FEATURES)  # kind of each feature
# Singular values of the features of a kind below this share of the largest are none: a millionth of its power.
RESOLVED = 1e-3
SEED = 20  # of the frequencies and phases: the same recordings get the same features


@dataclass(frozen=True, eq=False)
class Reach:
    """Range of every joint's motion."""

    middle: Array  # (n,), of the positions [rad or m]
    half: Array  # (n,), half width of the positions
    top: Array  # (n,), speed that one row in fifty exceeds [rad/s or m/s]

    @staticmethod
    def of(observations: Observations) -> "Reach":
        """That of some recordings."""
        position = np.concatenate([piece.prepared.motion.position for piece in observations])
        speed = np.abs(np.concatenate([piece.prepared.motion.velocity for piece in observations]))
        low, high = position.min(axis=0), position.max(axis=0)
        half, top = np.maximum((high - low) / 2.0, STANDING), np.quantile(speed, 0.98, axis=0) + STANDING
        return Reach((low + high) / 2.0, half, top)


def smooth_features(
    observations: Observations, model: ExtendedModel, joint: int, reach: Reach
) -> tuple[Array, NDArray[np.intp]]:
    """White rows of the features of one joint, (b, R), and the kind of each, (b,)."""
    draws = np.random.default_rng(SEED)
    frequency = draws.standard_normal((len(GROUP), 3)) * COORDINATES[GROUP] / LENGTH
    phase = draws.uniform(0.0, 2.0 * np.pi, len(GROUP))
    size = np.sqrt(2.0 / np.array(FEATURES))[GROUP]
    steepness = min(model.steepness[joint] or np.inf, SHARPEST / reach.top[joint])
    rows = []
    for piece in observations:
        motion = piece.prepared.motion
        velocity = motion.velocity[:, joint]
        state = np.stack(
            [
                (motion.position[:, joint] - reach.middle[joint]) / reach.half[joint],
                velocity / reach.top[joint],
                np.tanh(steepness * velocity),
            ]
        )
        values = size[:, None] * np.cos(frequency @ state + phase[:, None])
        rows.append(piece.repeated(motion.band.reduce(values)))
    white = observations.white(joint, rows)
    kinds = [_find_principal(white[kind == GROUP]) for kind in range(len(FEATURES))]
    return np.vstack(kinds), np.repeat(np.arange(len(kinds)), [len(each) for each in kinds])


def _find_principal(features: Array) -> Array:
    """Fewer features of the same covariance, (c, R). `features`: (b, R), white rows."""
    _, sizes, directions = np.linalg.svd(features, full_matrices=False)
    kept = sizes > RESOLVED * sizes.max(initial=0.0)
    return np.asarray(sizes[kept, None] * directions[kept])


def beyond(columns: Array, features: Array) -> Array:
    """`features`, (b, R), without what white `columns` of the nominal model, (k, R), can make, (b, R)."""
    length = np.linalg.norm(columns, axis=1, keepdims=True)
    unit = columns / np.where(length > 0.0, length, 1.0)
    squares, directions = np.linalg.eigh(unit @ unit.T)
    known = squares > DIRECTION**2 * squares.max(initial=0.0)
    basis = directions[:, known] / np.sqrt(squares[known])
    return features - ((features @ unit.T) @ basis) @ (basis.T @ unit)
