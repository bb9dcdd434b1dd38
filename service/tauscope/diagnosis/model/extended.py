"""The extended model: the nominal one, and the torque of the effects that were found beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.model.term import Term, shape_step
from tauscope.diagnosis.observations.observations import Piece
from tauscope.dynamics import smooth_sign, smooth_sign_slope
from tauscope.effects import Signals
from tauscope.effects.computation import THREADS, LastFew
from tauscope.identification.shape_sensitivity import ShapeParameter
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

# Sets of signals that are kept a piece: those of the model at hand, of the step that is tried, and of one more.
SIGNALS_KEPT = 3 * THREADS
STEEPNESS_DIFFERENCE = 0.01  # step of log K_v for the derivative of a term that has friction's step in it
# Relative standard error of a constant of the friction curve that the robot file states: it may be a guess.
STATED_ERROR = 0.15


@dataclass(frozen=True, eq=False)
class ExtendedModel:
    """τ = W(K_v, δ) Θ + Σ effects."""

    structure: ModelStructure
    parameters: Array  # (p,), Θ
    # (10 n,), standard parameters of the nearest physically consistent links, for effects that need a whole body
    links: Array
    # shape constants of the friction curve that are estimated along, as logarithms
    constants: tuple[ShapeParameter, ...]
    # for each of these the value that the robot file states, None where it states none
    stated: tuple[float | None, ...]
    terms: tuple[Term, ...] = ()
    covariance: Array | None = None  # (p, p), of Θ in a model that was saved; None where a fit has it, or nothing does

    @property
    def size(self) -> int:
        """Number of all parameters: Θ, constants, then every term's."""
        return self.structure.size + len(self.constants) + sum(term.size for term in self.terms)

    @property
    def steepness(self) -> Array:
        """K_v of every joint's friction, (n,) [s/rad or s/m]."""
        return np.array([terms.k_v for terms in self.structure.terms])

    def constant(self, place: int) -> float:
        """Present value of an estimated constant of the friction curve."""
        joint, name = self.constants[place]
        terms = self.structure.terms[joint]
        return terms.k_v if name == "k_v" else terms.delta or 0.0

    def prior(self) -> tuple[Array, Array]:
        """Rows of the robot file's statements about the friction curve, (s, p), and what they leave, (s,).

        A stated constant counts as measured once, with a relative standard error of `STATED_ERROR`.
        """
        rows, left = [], []
        for place, stated in enumerate(self.stated):
            if stated is not None:
                row = np.zeros(self.size)
                row[self.structure.size + place] = 1.0 / STATED_ERROR
                rows.append(row)
                left.append(np.log(stated / self.constant(place)) / STATED_ERROR)
        return np.array(rows).reshape(-1, self.size), np.array(left)

    def term_places(self) -> list[slice]:
        """Where each term's parameters stand among all."""
        first = self.structure.size + len(self.constants)
        places = []
        for term in self.terms:
            places.append(slice(first, first + term.size))
            first += term.size
        return places

    def slope_amplitudes(self, joint: int) -> tuple[list[int], Array]:
        """Places of a joint's own estimated constants among all parameters, and the coefficients beside them, (k,)."""
        places, amplitudes = [], []
        for place, (owner, name) in enumerate(self.constants):
            if owner == joint:
                column = self.structure.coefficient(joint, "stiction" if name == "k_v" else "stribeck")
                amplitudes.append(0.0 if column is None else float(self.parameters[column]))
                places.append(self.structure.size + place)
        return places, np.array(amplitudes)

    def slope_columns(self, piece: Piece, joint: int) -> Array:
        """∂τ/∂log K of a joint's own estimated constants for coefficients of one, in the common band, (k, M)."""
        velocity = piece.prepared.motion.velocity[:, joint]
        values = [self.constant(place) for place, (owner, _) in enumerate(self.constants) if owner == joint]
        if not values:
            return np.zeros((0, piece.rows))
        return piece.prepared.motion.band.reduce(
            np.stack([value * smooth_sign_slope(velocity, value) for value in values])
        )

    def standard_parameters(self) -> Array:
        """Standard parameters with the fitted base parameters, (10 n,): those in combinations only are zero."""
        base = self.structure.base
        standard = np.zeros_like(self.links)
        standard[base.independent_columns] = self.parameters[: self.structure.base_count]
        return standard

    def signals(self, piece: Piece) -> Signals:
        """One piece of motion with what the nominal part of the model says of it."""
        key = self.structure, self.parameters, self.links
        made = _kept_signals(piece).get(tuple(map(id, key)), lambda: (key, self._made_signals(piece)))
        return made[1]

    def signals_of_terms(self, piece: Piece) -> Signals:
        """The same as far as the columns of its terms need it: where none depends on Θ, that of any other Θ."""
        latest = _kept_signals(piece).latest
        effects = [term.effect for term in self.terms]
        if latest is None or not all(each.of_motion_alone or each.of_motion_and_step for each in effects):
            return self.signals(piece)
        _, known = latest
        if np.array_equal(known.steepness, self.steepness):
            return known
        kept: LastFew[bytes, Signals] = piece.memory.setdefault("signals of terms", LastFew(SIGNALS_KEPT))
        return kept.get(self.steepness.tobytes(), lambda: _with_steepness(known, self.steepness))

    def _made_signals(self, piece: Piece) -> Signals:
        """The same, made anew."""
        prepared, structure = piece.prepared, self.structure
        motion = prepared.motion
        load = np.empty(motion.position.T.shape)
        torque = np.empty_like(load)
        for joint, rigid in enumerate(piece.quiet_rigid()):
            links, plain = np.split(self.parameters[structure.joint_columns(joint)], [len(rigid)])
            own = structure.joint_term_columns(joint, motion.velocity[:, joint], motion.acceleration[:, joint])
            load[joint] = links @ rigid
            torque[joint] = load[joint] + plain @ own
        steepness = self.steepness
        velocity = np.ascontiguousarray(motion.velocity.T)
        return Signals(
            robot=structure.robot,
            rate_hz=motion.rate_hz,
            time=piece.time,
            recording=prepared.recording,
            position=np.ascontiguousarray(motion.position.T),
            velocity=velocity,
            acceleration=piece.quiet_acceleration(),
            load=load,
            torque=torque,
            step=smooth_sign(velocity, steepness[:, None]),
            steepness=steepness,
            bodies=self.standard_parameters(),
            links=self.links,
            periodic=motion.repetitions > 1,
            temperature=piece.temperature,
            of_motion=piece.memory.setdefault("of_motion", {}),
        )

    def term_torque(self, term: Term, signals: Signals) -> Array:
        """Torque of one term at the recorded rate, (m, N) or (m, P, N) for the joints that it touches."""
        return np.asarray(np.tensordot(term.coefficients, term_columns(term, signals), axes=1), dtype=np.float64)

    def factor(self, joint: int) -> float:
        """By how much the terms of a joint multiply what the plain model's parameters make there."""
        return float(
            np.prod([term.effect.factor(term.coefficients) for term in self.terms if term.effect.joint == joint])
        )

    def slope(self, joint: int, signals: Signals) -> Array:
        """∂τ_recorded/∂τ of a joint under all its terms, (N,)."""
        torque, terms = signals.torque[joint], [term for term in self.terms if term.effect.joint == joint]
        return np.prod([term.effect.slope(torque, term.coefficients, term.shape) for term in terms], axis=0)

    def step_sensitivity(self, term: Term, signals: Signals) -> Array:
        """∂τ/∂log K_v of a term whose torque has friction's step in it, K_v of its own joint, (1, N) or (1, P, N)."""
        own = np.arange(len(signals.steepness)) == term.effect.joint
        ahead, behind = (
            self.term_torque(term, _with_steepness(signals, signals.steepness * np.exp(sign * own)))
            for sign in (STEEPNESS_DIFFERENCE, -STEEPNESS_DIFFERENCE)
        )
        return (ahead - behind) / (2.0 * STEEPNESS_DIFFERENCE)


def term_columns(term: Term, signals: Signals) -> Array:
    """Columns of a term, (c, m, N) or (c, m, P, N) for the joints that it touches."""
    (columns,) = term.effect.columns(signals, term.shape[None])
    return columns


def shape_slopes(term: Term, signals: Signals) -> Array:
    """Slopes of a term's columns in each of its free shapes, at least one, (f, c, m, N) or (f, c, m, P, N)."""
    free = term.free_shapes
    steps = np.array([shape_step(term, place) for place in free])
    shapes = np.tile(term.shape, (2, len(free), 1))
    shapes[0, np.arange(len(free)), free] += steps
    shapes[1, np.arange(len(free)), free] -= steps
    columns = term.effect.columns(signals, shapes.reshape(2 * len(free), -1))
    ahead, behind = columns[: len(free)], columns[len(free) :]
    return (ahead - behind) / (2.0 * steps).reshape(-1, *[1] * (columns.ndim - 1))


def _kept_signals(piece: Piece) -> LastFew[tuple[int, ...], tuple[object, Signals]]:
    """Signals under the last few models, by the identity of what they depend on, which is kept beside them."""
    kept: LastFew[tuple[int, ...], tuple[object, Signals]] = piece.memory.setdefault("signals", LastFew(SIGNALS_KEPT))
    return kept


def _with_steepness(signals: Signals, steepness: Array) -> Signals:
    """The same signals with other K_v, (n,)."""
    step = signals.step.copy()
    for joint in np.flatnonzero(steepness != signals.steepness):
        step[joint] = smooth_sign(signals.velocity[joint], steepness[joint])
    return replace(signals, steepness=steepness, step=step, _memory={})


def with_terms(model: ExtendedModel, terms: Sequence[Term]) -> ExtendedModel:
    """The same nominal part with other effects."""
    return replace(model, terms=tuple(terms))


def move_model(model: ExtendedModel, step: Array) -> ExtendedModel:
    """The model moved by a step, (p,), each shape within its bounds and what its coefficients let it be."""
    size = model.structure.size
    terms = list(model.structure.terms)
    for place, (joint, name) in enumerate(model.constants):
        if step[size + place]:
            terms[joint] = replace(terms[joint], **{name: model.constant(place) * float(np.exp(step[size + place]))})
    moved = []
    for term, place in zip(model.terms, model.term_places(), strict=True):
        count, effect, shape, free = len(term.coefficients), term.effect, term.shape.copy(), list(term.free_shapes)
        coefficients = term.coefficients + step[place][:count]
        shape[free] += step[place][count:]
        for lower, upper in (effect.limits(coefficients, shape), (effect.lower, effect.upper)):
            shape[free] = np.clip(shape[free], lower[free], upper[free])
        moved.append(replace(term, shape=shape, coefficients=coefficients))
    structure = model.structure.with_terms(tuple(terms))
    return replace(model, structure=structure, parameters=model.parameters + step[:size], terms=tuple(moved))
