"""The rows of a diagnosis as evidence sees them: those of stops left out, the others in classes of rest.

Near rest friction takes any value up to breakaway, which no curve of the velocity says: those rows have a variance of
their own (`Scales`), and those of a stop, where friction holds with whatever torque there is, say nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.evidence.discrepancy import GROUP, Reach, beyond, smooth_features
from tauscope.diagnosis.evidence.moments import JointMoments
from tauscope.diagnosis.evidence.scales import REST_BOUNDS, REST_SHARES
from tauscope.diagnosis.fitting.projection import JointColumns
from tauscope.diagnosis.fitting.regressor_noise import certainty, shared_errors
from tauscope.diagnosis.fitting.white_columns import WhiteColumns
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import BoolArray, Observations, Piece
from tauscope.recording.recording import Array

REVERSAL = 2.0
"""Speed in widths 1/K_v of friction's step below which a joint is near rest."""

UNCERTAIN = 3.0
"""…or in standard deviations of the velocity's noise, where that is more."""

OPEN = 1.0
"""Part of the power of a step's error that a row is held to be off by: all of it."""

AROUND_STOP = 1
"""Rows on either side of a stop that share its samples."""


@dataclass(frozen=True, eq=False)
class EvidenceRows:
    """White rows of every joint in order of their class of rest.

    order : tuple of (R_j,) int
        which of the white rows count, class by class
    certain : tuple of (R_j,) float64
        weight of each of them beside friction's step, whose place the velocity's noise leaves open
    bounds : tuple of (K + 1,) int
        where each class begins
    features : tuple of (b, R_j) float64
        discrepancy, then errors that all reversals share
    """

    observations: Observations
    white: WhiteColumns
    order: tuple[NDArray[np.intp], ...]
    certain: tuple[Array, ...]
    bounds: tuple[NDArray[np.intp], ...]
    features: tuple[Array, ...]
    groups: NDArray[np.intp]

    @staticmethod
    def prepare(observations: Observations, model: ExtendedModel) -> "EvidenceRows":
        """Rows of training recordings beside a nominal model."""
        reach, white = Reach.of(observations), WhiteColumns(observations)
        order, certain, bounds, features = [], [], [], []
        shared = 0
        for joint in range(observations.robot.joint_count):
            near, stopped = find_rest(observations, model, joint)
            kinds = np.digitize(near, REST_BOUNDS)
            places = [np.flatnonzero((kinds == kind) & ~stopped) for kind in range(len(REST_SHARES))]
            order.append(np.concatenate(places))
            certain.append(certainty(observations, model, joint, OPEN)[order[-1]])
            bounds.append(np.cumsum([0, *map(len, places)]))
            smooth = smooth_features(observations, model, joint, reach)
            errors = shared_errors(observations, model, joint, np.ones(smooth.shape[1]))
            shared = len(errors)
            features.append(np.vstack([smooth, errors])[:, order[-1]] * certain[-1])
        groups = np.concatenate([GROUP, np.full(shared, -1)])
        return EvidenceRows(observations, white, tuple(order), tuple(certain), tuple(bounds), tuple(features), groups)

    def take(self, joint: int, rows: Array) -> Array:
        """The rows of a joint that count, in order of their class, (…, R_j).

        Parameters
        ----------
        joint : int
            joint index, from 0
        rows : (…, R) float64
            white rows
        """
        return rows[..., self.order[joint]] * self.certain[joint]

    def moments(self, model: ExtendedModel, *, owned: bool = False) -> tuple[JointMoments, ...]:
        """What a model leaves, and the slopes of that in all its parameters, one entry a joint.

        The discrepancy is beyond what the nominal model can make; where terms are `owned`, beyond what they can, too.
        """
        linear = zip(self.white.residual(model), self.white.all(model), strict=True)
        plain = model.size if owned else model.structure.size + len(model.constants)
        return tuple(self._joint_moments(joint, *own, plain) for joint, own in enumerate(linear))

    def _joint_moments(self, joint: int, residual: Array, linear: JointColumns, plain: int) -> JointMoments:
        """Those of one joint, with a discrepancy beyond the columns of the first parameters."""
        columns, smooth = self.take(joint, linear.rows), self.groups >= 0
        features = self.features[joint].copy()
        features[smooth] = beyond(columns[linear.index < plain], features[smooth])
        share = self.observations.noise[joint].share
        target = self.take(joint, residual)
        return JointMoments.of(linear.index, target, columns, features, self.bounds[joint], share, self.groups)

    def measured_rms(self, joint: int) -> float:
        """Rms of a joint's white torque."""
        torque = self.take(joint, self.white.measured(joint))
        return float(np.sqrt(np.mean(torque**2))) if torque.size else 0.0


def find_rest(observations: Observations, model: ExtendedModel, joint: int) -> tuple[Array, BoolArray]:
    """Share of every white row's samples near rest, (R,), and which rows are of a stop, (R,).

    Parameters
    ----------
    joint : int
        joint index, from 0
    """
    order = observations.noise[joint].order if observations.noise else 0
    kept = observations.kept(joint)
    near = np.concatenate([_measure_rest(piece, model, joint)[order:] for piece in observations])
    stopped = np.concatenate([_find_stops(piece, joint)[order:] for piece in observations])
    return near[kept], stopped[kept]


def _measure_rest(piece: Piece, model: ExtendedModel, joint: int) -> Array:
    """Share of each row's samples at which a joint hardly moves, (P M,)."""
    motion = piece.prepared.motion
    steepness = model.structure.terms[joint].k_v
    slowest = UNCERTAIN * float(piece.velocity_std[joint])
    if steepness:
        slowest = max(slowest, REVERSAL / steepness)
    slow = (np.abs(motion.velocity[:, joint]) < slowest).astype(np.float64)
    return np.clip(piece.repeated(motion.band.reduce(slow[None]))[0], 0.0, 1.0)


def _find_stops(piece: Piece, joint: int) -> BoolArray:
    """Rows of a stop of a joint, (P M,)."""
    stopped = np.zeros(piece.rows, dtype=bool)
    for stop in piece.prepared.stops(joint):
        stopped[max(stop.start - AROUND_STOP, 0) : stop.stop + AROUND_STOP] = True
    return np.tile(stopped, piece.repetitions)
