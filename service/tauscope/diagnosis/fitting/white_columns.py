"""What a model leaves, and the slopes of that in all its parameters, in whitened rows.

A model is linear in Θ and in its terms' coefficients, so that its torque is a combination of its own columns. Columns
of the links never change; those of friction change with its constants alone, those of a term with its shape and, of
some effects, with what the nominal part says. They are kept from one model to the next. Slopes in friction's constants
and in shapes are made where somebody asks for them: most models that are tried need only say what they leave.
"""

from collections.abc import Sequence

import numpy as np

from tauscope.diagnosis.fitting.projection import JointColumns
from tauscope.diagnosis.model.extended import ExtendedModel, shape_slopes, term_columns
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.observations.observations import Observations
from tauscope.effects import Effect, Signals
from tauscope.effects.computation import THREADS, LastFew
from tauscope.recording.recording import Array

# Sets of friction columns that are kept a joint: those of the model at hand, and of the step that is tried.
FRICTION_KEPT = 2 * THREADS
TERMS_KEPT = 24 * THREADS  # terms whose columns are kept: as many as two models have, and those that a step tried
SHAPES_AT_ONCE = 48  # shapes of an effect whose columns are made together: bounds memory
OfJoints = dict[int, Array]  # white rows (…, R_j) of each joint that a term touches


class WhiteColumns:
    """Linearises extended models on the same observations."""

    def __init__(self, observations: Observations) -> None:
        self._observations = observations
        self._joints = range(observations.robot.joint_count)
        self._measured: dict[int, Array] = {}
        self._rigid: dict[int, Array] = {}
        self._terms: LastFew[tuple[object, ...], tuple[Effect, OfJoints]] = LastFew(TERMS_KEPT)
        self._shape_slopes: LastFew[tuple[object, ...], tuple[Effect, OfJoints]] = LastFew(TERMS_KEPT)
        self._friction: list[LastFew[object, Array]] = [LastFew(FRICTION_KEPT) for _ in self._joints]
        self._friction_slopes: list[LastFew[object, Array]] = [LastFew(FRICTION_KEPT) for _ in self._joints]

    def residual(self, model: ExtendedModel) -> list[Array]:
        """What a model leaves of the measured torque, (R_j,) a joint."""
        return [self.residual_at(model, joint) for joint in self._joints]

    def residual_at(self, model: ExtendedModel, joint: int) -> Array:
        """What it leaves of the measured torque of one joint, (R,)."""
        rigid, friction = self._white_rigid(joint), self._white_friction(model, joint)
        links, plain = np.split(model.parameters[model.structure.joint_columns(joint)], [len(rigid)])
        found = self.measured(joint) - links @ rigid - plain @ friction
        for term, _ in self._terms_at(model, joint):
            found -= term.coefficients @ self._white_term(model, term)[joint]
        return np.asarray(found)

    def all(self, model: ExtendedModel) -> list[JointColumns]:
        """Columns of all parameters, a joint each: slopes of the model's torque."""
        return [self.all_at(model, joint) for joint in self._joints]

    def all_at(self, model: ExtendedModel, joint: int) -> JointColumns:
        """Columns of all parameters at one joint."""
        factor, (places, amplitudes) = self._scale(model, joint), model.slope_amplitudes(joint)
        slopes = factor * amplitudes[:, None] * self._white_friction_slopes(model, joint)
        index = [int(place) for place in model.structure.joint_columns(joint)]
        rows = [factor * self._white_rigid(joint), factor * self._white_friction(model, joint)]
        terms = self._terms_at(model, joint)
        for term, place in terms:
            index += range(place.start, place.start + len(term.coefficients))
            rows.append(self._white_term(model, term)[joint])
        index += places
        rows.append(slopes + self._of_steps(model, joint, places))
        for term, place in terms:
            if term.free_shapes:
                index += range(place.start + len(term.coefficients), place.stop)
                rows.append(term.coefficients @ self._white_shape_slopes(model, term)[joint])
        return JointColumns(np.array(index, dtype=np.intp), np.concatenate(rows))

    def key(self, model: ExtendedModel, joint: int) -> tuple[object, ...]:
        """All that the residual and the columns of a joint depend on."""
        terms: list[object] = []
        for term, place in self._terms_at(model, joint):
            terms.append((_key(model, term), term.coefficients.tobytes(), place.start))
            if term.effect.bends:
                terms.append((model.structure.terms, model.parameters.tobytes()))
        own = model.parameters[model.structure.joint_columns(joint)]
        return model.structure.terms[joint], own.tobytes(), tuple(terms)

    def _terms_at(self, model: ExtendedModel, joint: int) -> list[tuple[Term, slice]]:
        """Terms that touch a joint, and where their parameters stand."""
        terms = zip(model.terms, model.term_places(), strict=True)
        return [each for each in terms if joint in each[0].effect.touched(len(self._joints))]

    def _scale(self, model: ExtendedModel, joint: int) -> Array | float:
        """∂τ_recorded/∂τ of every row, (R,), or of all; whitening mixes neighbours, for which it is nearly the same."""
        if not any(term.effect.bends for term in model.terms if term.effect.joint == joint):
            return model.factor(joint)
        observations = self._observations
        order = observations.noise[joint].order if observations.noise else 0
        rows = [
            piece.repeated(piece.prepared.motion.band.reduce(model.slope(joint, model.signals(piece))[None]))[0, order:]
            for piece in observations
        ]
        return np.concatenate(rows)[observations.kept(joint)]

    def _white_term(self, model: ExtendedModel, term: Term) -> OfJoints:
        """Columns of a term, (c, R_j) at every joint that it touches."""

        def made() -> tuple[Effect, OfJoints]:
            pieces = [term_columns(term, model.signals_of_terms(piece)) for piece in self._observations]
            return term.effect, self._white(term, pieces)

        return self._terms.get(_key(model, term), made)[1]

    def _white_shape_slopes(self, model: ExtendedModel, term: Term) -> OfJoints:
        """Slopes of a term's columns in each of its free shapes, (f, c, R_j) at every joint that it touches."""
        free, count = len(term.free_shapes), len(term.coefficients)

        def made() -> tuple[Effect, OfJoints]:
            pieces = [shape_slopes(term, model.signals_of_terms(piece)) for piece in self._observations]
            white = self._white(term, [each.reshape(-1, *each.shape[2:]) for each in pieces])
            return term.effect, {joint: rows.reshape(free, count, -1) for joint, rows in white.items()}

        return self._shape_slopes.get(_key(model, term), made)[1]

    def _white(self, term: Term, pieces: Sequence[Array]) -> OfJoints:
        """A term's signals (k, m, N) or (k, m, P, N) of every piece as white rows (k, R_j) of every joint."""
        rows = {
            joint: [
                piece.reduced(np.ascontiguousarray(own[:, slot]))
                for piece, own in zip(self._observations, pieces, strict=True)
            ]
            for slot, joint in enumerate(term.effect.touched(len(self._joints)))
        }
        return {joint: self._observations.white(joint, parts) for joint, parts in rows.items()}

    def measured(self, joint: int) -> Array:
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

    def _white_friction(self, model: ExtendedModel, joint: int) -> Array:
        """Columns of a joint's own plain friction, (k, R)."""

        def made() -> Array:
            rows = []
            for piece in self._observations:
                motion, columns = piece.prepared.motion, model.structure.joint_term_columns
                own = columns(joint, motion.velocity[:, joint], motion.acceleration[:, joint])
                rows.append(piece.repeated(motion.band.reduce(own)))
            return self._observations.white(joint, rows)

        return self._friction[joint].get(model.structure.terms[joint], made)

    def _white_friction_slopes(self, model: ExtendedModel, joint: int) -> Array:
        """∂τ/∂log K of the constants of a joint's friction, for coefficients of one, (s, R)."""

        def made() -> Array:
            rows = [piece.repeated(model.slope_columns(piece, joint)) for piece in self._observations]
            return self._observations.white(joint, rows)

        constants = tuple(name for owner, name in model.constants if owner == joint)
        return self._friction_slopes[joint].get((model.structure.terms[joint], constants), made)

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


def _key(model: ExtendedModel, term: Term) -> tuple[object, ...]:
    """All that a term's columns depend on.

    An effect counts by its identity, for one of a user's may have no hash: it is kept beside them, so that no other
    takes that.
    """
    return id(term.effect), term.shape.tobytes(), _beside(model, term)


def white_columns(
    observations: Observations, effect: Effect, shapes: Array, signals: Sequence[Signals]
) -> dict[int, Array]:
    """Whitened columns (g, c, R_j) of an effect at every joint that it touches. `shapes`: (g, k), shapes."""
    touched = effect.touched(observations.robot.joint_count)
    rows: dict[int, list[Array]] = {joint: [] for joint in touched}
    count = 1
    for piece, own in zip(observations, signals, strict=True):
        columns = effect.columns(own, shapes)
        count = columns.shape[1]
        for slot, joint in enumerate(touched):
            values = columns[:, :, slot]
            flat = values.reshape(len(shapes) * count, *values.shape[2:])
            rows[joint].append(piece.reduced(np.ascontiguousarray(flat)))
    white = {joint: observations.white(joint, parts) for joint, parts in rows.items()}
    return {joint: each.reshape(len(shapes), count, -1) for joint, each in white.items()}
