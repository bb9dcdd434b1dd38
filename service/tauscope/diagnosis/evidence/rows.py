"""The rows of a diagnosis as evidence sees them, in classes of rest.

Near rest friction takes any value up to breakaway, which no curve of the velocity says: those rows have a variance of
their own (`Scales`). All rows of a stop count as one, whose friction is unknown up to breakaway.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.evidence.dependence import Succession
from tauscope.diagnosis.evidence.discrepancy import Reach, beyond, smooth_features
from tauscope.diagnosis.evidence.moments import JointMoments
from tauscope.diagnosis.evidence.scales import REST_BOUNDS, REST_SHARES, Scales
from tauscope.diagnosis.fitting.projection import JointColumns
from tauscope.diagnosis.fitting.regressor_noise import certainty, shared_errors
from tauscope.diagnosis.fitting.white_columns import WhiteColumns, white_columns
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations, Piece
from tauscope.effects import Effect, Signals
from tauscope.effects.computation import THREADS, LastFew
from tauscope.recording.recording import Array

REVERSAL = 2.0  # speed in widths 1/K_v of friction's step below which a joint is near rest
UNCERTAIN = 3.0  # …or in standard deviations of the velocity's noise, where that is more
OPEN = 1.0  # part of the power of a step's error that a row is held to be off by: all of it
AROUND_STOP = 1  # rows on either side of a stop that share its samples
# Moments that are kept a joint: those of the hypothesis at hand, and of another that differs from it there.
MOMENTS_KEPT = 2 * THREADS


@dataclass(frozen=True, eq=False)
class EvidenceRows:
    """White rows of every joint in order of their class of rest."""

    observations: Observations
    white: WhiteColumns
    order: tuple[NDArray[np.intp], ...]  # tuple of (R_j,), which of the white rows count, class by class
    # tuple of (R_j,), weight of each of them beside friction's step, whose place the velocity's noise leaves open
    certain: tuple[Array, ...]
    bounds: tuple[NDArray[np.intp], ...]  # tuple of (K + 1,), where each class begins
    # tuple of (b_j, R_j), discrepancy, then errors that all reversals share, in order of time
    features: tuple[Array, ...]
    groups: tuple[NDArray[np.intp], ...]  # tuple of (b_j,), kind of each; -1 for an error
    successions: tuple[Succession, ...]
    _known: LastFew[tuple[object, ...], tuple[ExtendedModel, JointMoments]] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_known", LastFew(MOMENTS_KEPT * len(self.order)))

    @staticmethod
    def prepare(observations: Observations, model: ExtendedModel) -> "EvidenceRows":
        """Rows of training recordings beside a nominal model."""
        reach, white = Reach.of(observations), WhiteColumns(observations)
        order, certain, bounds, features, groups, successions = [], [], [], [], [], []
        for joint in range(observations.robot.joint_count):
            near, _ = find_rest(observations, model, joint)
            kinds = np.digitize(near, REST_BOUNDS)
            places = [np.flatnonzero(kinds == kind) for kind in range(len(REST_SHARES))]
            order.append(np.concatenate(places))
            certain.append(weigh_rows(observations, model, joint)[order[-1]])
            bounds.append(np.cumsum([0, *map(len, places)]))
            smooth, kinds = smooth_features(observations, model, joint, reach)
            errors = shared_errors(observations, model, joint, np.ones(smooth.shape[1]))
            features.append(np.vstack([smooth, errors]))
            groups.append(np.concatenate([kinds, np.full(len(errors), -1)]))
            successions.append(Succession.of(*observations.row_labels(joint)))
        return EvidenceRows(
            observations,
            white,
            tuple(order),
            tuple(certain),
            tuple(bounds),
            tuple(features),
            tuple(groups),
            tuple(successions),
        )

    def under(self, model: ExtendedModel, scales: Sequence[Scales]) -> "EvidenceRows":
        """The same rows, their uncertainty beside the noise of some scales."""
        weights = (weigh_rows(self.observations, model, joint, own.noise) for joint, own in enumerate(scales))
        return replace(self, certain=tuple(own[order] for own, order in zip(weights, self.order, strict=True)))

    def take(self, joint: int, rows: Array, dependence: float) -> Array:
        """Those of `rows`, (…, R), that count, as much as they tell under κ, in order of class, (…, R_j)."""
        return rows[..., self.order[joint]] * (self.certain[joint] / np.sqrt(dependence))

    def moments(
        self, model: ExtendedModel, dependence: Sequence[float], *, owned: bool = False
    ) -> tuple[JointMoments, ...]:
        """Residual and slopes by joint; the discrepancy is beyond the nominal columns, or all where `owned`."""
        return tuple(self._joint_moments(joint, model, own, owned=owned) for joint, own in enumerate(dependence))

    def _joint_moments(self, joint: int, model: ExtendedModel, dependence: float, *, owned: bool) -> JointMoments:
        """Those of one joint: most hypotheses differ from another one at few joints."""

        def made() -> tuple[ExtendedModel, JointMoments]:
            plain = model.size if owned else model.structure.size + len(model.constants)
            own = self.white.residual_at(model, joint), self.white.all_at(model, joint)
            return model, self.joint_moments(joint, *own, dependence, plain)

        return self._known.get((joint, dependence, owned, *self.white.key(model, joint)), made)[1]

    def joint_moments(
        self, joint: int, residual: Array, linear: JointColumns, dependence: float, plain: int
    ) -> JointMoments:
        """Those of one joint's white `residual`, (R,), its discrepancy beyond the columns of `plain` parameters."""
        columns, smooth = self.take(joint, linear.rows, dependence), self.groups[joint] >= 0
        features = self.take(joint, self.features[joint], dependence)
        features[smooth] = beyond(columns[linear.index < plain], features[smooth])
        # Σ log(σ² + u²) over rows of uncertainty u grows with log σ² by 1 / (1 + u²/σ²) for each.
        told = np.add.reduceat(np.append(self.certain[joint] ** 2, 0.0), self.bounds[joint][:-1])
        told = np.where(np.diff(self.bounds[joint]) > 0, told, 0.0)
        counts = told * self.observations.noise[joint].share / dependence
        target = self.take(joint, residual, dependence)
        return JointMoments.of(linear.index, target, columns, features, self.bounds[joint], counts, self.groups[joint])

    def dependence(self, joint: int, left: Array) -> float:
        """κ of what a model leaves beside its discrepancy. `left`: (R_j,), in order of class."""
        rows, moving = np.zeros(self.features[joint].shape[1]), self.bounds[joint][1]
        rows[self.order[joint][:moving]] = left[:moving]
        return self.successions[joint].dependence(rows)

    def columns(self, effect: Effect, shapes: Array, signals: Sequence[Signals]) -> dict[int, Array]:
        """White rows of an effect of `shapes`, (s, k), at every joint that it touches, in order of time, (s, c, R)."""
        return white_columns(self.observations, effect, shapes, signals)

    @property
    def interval_s(self) -> float:
        """Time between rows [s]."""
        first = next(iter(self.observations)).row_times()
        return float(first[1] - first[0])

    def measured_rms(self, joint: int, dependence: float) -> float:
        """Rms of a joint's white torque."""
        torque = self.take(joint, self.white.measured(joint), dependence)
        return float(np.sqrt(np.mean(torque**2))) if torque.size else 0.0


def find_rest(observations: Observations, model: ExtendedModel, joint: int) -> tuple[Array, NDArray[np.intp]]:
    """Share of every white row's samples near rest, (R,), and which stop it is of, from 1, or 0 for none, (R,)."""
    order = observations.noise[joint].order if observations.noise else 0
    kept = observations.kept(joint)
    near = np.concatenate([_measure_rest(piece, model, joint)[order:] for piece in observations])
    stops, count = [], 0
    for piece in observations:
        own = _find_stops(piece, joint)
        stops.append(np.where(own > 0, own + count, 0)[order:])
        count += int(own.max(initial=0))
    return near[kept], np.concatenate(stops)[kept]


def weigh_rows(observations: Observations, model: ExtendedModel, joint: int, noise: float = 1.0) -> Array:
    """How much every white row tells beside friction's step and at stops, (R,); `noise`: σ over white noise."""
    _, stops = find_rest(observations, model, joint)
    certain = certainty(observations, model, joint, OPEN / noise**2)
    return certain * _weigh_stops(observations, model, joint, stops, noise)


def _weigh_stops(
    observations: Observations, model: ExtendedModel, joint: int, stops: NDArray[np.intp], noise: float
) -> Array:
    """Weight of each row, (R,): all rows of a stop count as one, whose friction is anything up to breakaway."""
    column = model.structure.coefficient(joint, "stiction")
    breakaway = 0.0 if column is None else float(model.parameters[column])
    power = 1.0 + breakaway**2 / (observations.noise[joint].model.variance * noise**2)
    rows = np.bincount(stops)[stops]
    return np.where(stops > 0, 1.0 / np.sqrt(rows * power), 1.0)


def _measure_rest(piece: Piece, model: ExtendedModel, joint: int) -> Array:
    """Share of each row's samples at which a joint hardly moves, (P M,)."""
    motion = piece.prepared.motion
    steepness = model.structure.terms[joint].k_v
    slowest = UNCERTAIN * float(piece.velocity_std[joint])
    if steepness:
        slowest = max(slowest, REVERSAL / steepness)
    slow = (np.abs(motion.velocity[:, joint]) < slowest).astype(np.float64)
    return np.clip(piece.repeated(motion.band.reduce(slow[None]))[0], 0.0, 1.0)


def _find_stops(piece: Piece, joint: int) -> NDArray[np.intp]:
    """Number of the stop that each row is of, from 1, or 0 for none, (P M,)."""
    stopped = np.zeros(piece.rows, dtype=np.intp)
    for number, stop in enumerate(piece.prepared.stops(joint), start=1):
        stopped[max(stop.start - AROUND_STOP, 0) : stop.stop + AROUND_STOP] = number
    return np.tile(stopped, piece.repetitions)
