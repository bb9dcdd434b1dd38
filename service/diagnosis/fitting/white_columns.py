"""What a model leaves, and the slopes of that in all its parameters, in whitened rows.

A model is linear in Θ and in its terms' coefficients, so that its torque is a combination of its own columns. Columns
of the links never change; those of friction change with its constants alone, those of a term with its shape and, of
some effects, with what the nominal part says. They are kept from one model to the next.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.diagnosis.catalogue import Effect
from service.diagnosis.fitting.projection import JointColumns
from service.diagnosis.model.extended import ExtendedModel, term_columns
from service.diagnosis.model.term import Term
from service.diagnosis.observations.observations import Observations
from service.recording.recording import Array

KEPT = 2
"""Sets of friction columns that are kept a joint: those of the model at hand, and of the step that is tried."""

TERMS_KEPT = 24
"""Terms whose columns are kept: as many as two models have, and those that a step tried."""

Constants = tuple[object, ...]


@dataclass(frozen=True, eq=False)
class _Friction:
    """White columns of one joint's friction for given constants.

    plain : (k, R) float64
        of its own parameters
    slopes : (s, R) float64
        ∂τ/∂log K of its constants, for coefficients of one
    """

    plain: Array
    slopes: Array


@dataclass(frozen=True, eq=False)
class _Terms:
    """All terms at one joint.

    coefficients : (k,) float64
        of the columns; zero for those of shapes
    columns : JointColumns
        slopes of their torque in each of their parameters
    """

    coefficients: Array
    columns: JointColumns


class WhiteColumns:
    """Linearises extended models on the same observations.

    Parameters
    ----------
    observations : Observations
        the data, noise known
    """

    def __init__(self, observations: Observations) -> None:
        self._observations = observations
        self._term_columns: dict[tuple[object, ...], tuple[Effect, dict[int, Array]]] = {}
        self._measured: dict[int, Array] = {}
        self._rigid: dict[int, Array] = {}
        self._friction: dict[int, dict[Constants, _Friction]] = {}

    def linearised(self, model: ExtendedModel) -> tuple[list[Array], list[JointColumns]]:
        """Whitened residual (R_j,), and columns of all parameters, a joint each.

        Parameters
        ----------
        model : ExtendedModel
            the model
        """
        residual, columns = [], []
        for joint, terms in enumerate(self._of_terms(model)):
            rigid, friction = self._white_rigid(joint), self._white_friction(model, joint)
            places = model.structure.joint_columns(joint)
            links, plain = np.split(model.parameters[places], [len(rigid)])
            nominal = links @ rigid + plain @ friction.plain
            residual.append(self._white_measured(joint) - nominal - terms.coefficients @ terms.columns.rows)
            constants, amplitudes = model.slope_amplitudes(joint)
            factor = model.factor(joint)
            slopes = factor * amplitudes[:, None] * friction.slopes + self._of_steps(model, joint, constants)
            index = np.concatenate([places, constants, terms.columns.index]).astype(np.intp)
            rows = np.concatenate([factor * rigid, factor * friction.plain, slopes, terms.columns.rows])
            columns.append(JointColumns(index, rows))
        return residual, columns

    def _of_terms(self, model: ExtendedModel) -> list[_Terms]:
        """Columns of all terms, a joint each."""
        joints = range(self._observations.robot.joint_count)
        index: list[list[int]] = [[] for _ in joints]
        coefficients: list[list[float]] = [[] for _ in joints]
        rows: list[list[Array]] = [[np.zeros((0, len(self._white_measured(joint))))] for joint in joints]
        for term, place in zip(model.terms, model.term_places(), strict=True):
            for joint, (columns, *slopes) in self._white_term(model, term).items():
                index[joint] += range(place.start, place.stop)
                coefficients[joint] += [*term.coefficients, *[0.0] * len(slopes)]
                rows[joint] += [columns, *((term.coefficients @ each)[None] for each in slopes)]
        return [
            _Terms(np.array(weights), JointColumns(np.array(places, dtype=np.intp), np.concatenate(own)))
            for places, weights, own in zip(index, coefficients, rows, strict=True)
        ]

    def _white_term(self, model: ExtendedModel, term: Term) -> dict[int, Array]:
        """Columns of a term and their slopes in its free shapes, (1 + f, c, R_j), at every joint that it touches."""
        # by the effect's identity, for one of a user's may have no hash; it is kept, so that no other takes that
        key = id(term.effect), term.shape.tobytes(), _beside(model, term)
        if key not in self._term_columns:
            while len(self._term_columns) >= TERMS_KEPT:
                self._term_columns.pop(next(iter(self._term_columns)))
            self._term_columns[key] = term.effect, self._made_term(model, term)
        return self._term_columns[key][1]

    def _made_term(self, model: ExtendedModel, term: Term) -> dict[int, Array]:
        """The same, made anew."""
        touched = term.effect.touched(self._observations.robot.joint_count)
        rows: dict[int, list[Array]] = {joint: [] for joint in touched}
        for piece in self._observations:
            columns = term_columns(term, model.signals_of_terms(piece))
            for slot, joint in enumerate(touched):
                rows[joint].append(piece.reduced(columns[:, :, slot].reshape(-1, *columns.shape[3:])))
        white = {joint: self._observations.white(joint, parts) for joint, parts in rows.items()}
        count = len(term.coefficients)
        return {joint: each.reshape(-1, count, each.shape[1]) for joint, each in white.items()}

    def _white_measured(self, joint: int) -> Array:
        """Measured torque, (R,)."""
        if joint not in self._measured:
            (self._measured[joint],) = self._observations.white(joint, self._observations.torque(joint))
        return self._measured[joint]

    def _white_rigid(self, joint: int) -> Array:
        """Columns of the links, which no fit changes."""
        if joint not in self._rigid:
            rows = [piece.repeated(piece.prepared.reduced_rigid[joint]) for piece in self._observations]
            self._rigid[joint] = self._observations.white(joint, rows)
        return self._rigid[joint]

    def _white_friction(self, model: ExtendedModel, joint: int) -> _Friction:
        """Columns of friction, from an earlier model with the same constants where there was one."""
        kept = self._friction.setdefault(joint, {})
        key = model.structure.terms[joint], tuple(name for owner, name in model.constants if owner == joint)
        if key not in kept:
            while len(kept) >= KEPT:
                kept.pop(next(iter(kept)))
            kept[key] = self._made_friction(model, joint)
        return kept[key]

    def _made_friction(self, model: ExtendedModel, joint: int) -> _Friction:
        plain, slopes = [], []
        for piece in self._observations:
            motion = piece.prepared.motion
            own = model.structure.joint_term_columns(joint, motion.velocity[:, joint], motion.acceleration[:, joint])
            plain.append(piece.repeated(motion.band.reduce(own)))
            slopes.append(piece.repeated(model.slope_columns(piece, joint)))
        return _Friction(self._observations.white(joint, plain), self._observations.white(joint, slopes))

    def _of_steps(self, model: ExtendedModel, joint: int, places: Sequence[int]) -> Array:
        """What K_v changes of a joint's terms that have friction's step in them, a row for each of its constants."""
        stepping = [term for term in model.terms if term.effect.has_step and term.effect.joint == joint]
        of_k_v = [model.constants[place - model.structure.size] == (joint, "k_v") for place in places]
        if not stepping or not any(of_k_v):
            return np.zeros((len(places), 1))
        pieces = [
            sum(piece.reduced(model.step_sensitivity(term, model.signals_of_terms(piece))) for term in stepping)
            for piece in self._observations
        ]
        white = self._observations.white(joint, [np.asarray(rows) for rows in pieces])
        return np.where(np.array(of_k_v)[:, None], white, 0.0)


def _beside(model: ExtendedModel, term: Term) -> tuple[object, ...]:
    """What else of a model changes a term's columns."""
    effect = term.effect
    if effect.of_motion_alone:
        return ()
    if effect.of_motion_and_step:
        return (model.steepness[slice(None) if effect.joint is None else effect.joint].tobytes(),)
    return model.structure.terms, model.parameters.tobytes()
