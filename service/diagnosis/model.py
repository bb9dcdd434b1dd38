"""The extended model: the nominal one, and the torque of the effects that were found beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.diagnosis.catalogue import Effect, Signals
from service.diagnosis.observations import Observations, Piece
from service.dynamics import smooth_sign, smooth_sign_slope
from service.identification.shape_sensitivity import ShapeParameter
from service.identification.structure import ModelStructure
from service.recording.recording import Array

DIFFERENCE = 1e-3
"""Step of a shape parameter for its derivative, relative to its bounds or, where logarithmic, to itself."""


HOLDING = 1e8
"""Inverse of the standard error [SI] of a parameter that no fit may move."""

SIGNALS_KEPT = 3
"""Sets of signals that are kept a piece: those of the model at hand, of the step that is tried, and of one more."""

STATED_ERROR = 0.15
"""Relative standard error of a constant of the friction curve that the robot file states: it may be a guess."""


@dataclass(frozen=True, eq=False)
class Term:
    """An effect in the model.

    effect : Effect
        its form and place
    shape : (k,) float64
        values of its shape parameters
    coefficients : (c,) float64
        values of its coefficients
    """

    effect: Effect
    shape: Array
    coefficients: Array

    @property
    def free_shapes(self) -> list[int]:
        """Places of the shape parameters that are estimated, not merely chosen."""
        return [place for place in range(len(self.shape)) if self.effect.is_free(place)]

    @property
    def size(self) -> int:
        """Number of its parameters: coefficients, then free shapes."""
        return len(self.coefficients) + len(self.free_shapes)


@dataclass(frozen=True, eq=False)
class ExtendedModel:
    """τ = W(K_v, δ) Θ + Σ effects.

    structure : ModelStructure
        the nominal columns with their present shape constants
    parameters : (p,) float64
        Θ
    links : (10 n,) float64
        standard parameters of the nearest physically consistent links, for effects that need a whole body
    constants : tuple of (int, str)
        shape constants of the friction curve that are estimated along, as logarithms
    stated : tuple of float or None
        for each of these the value that the robot file states, None where it states none
    terms : tuple of Term
        effects beside the nominal model
    held : tuple of int
        places among Θ that no fit moves
    """

    structure: ModelStructure
    parameters: Array
    links: Array
    constants: tuple[ShapeParameter, ...]
    stated: tuple[float | None, ...]
    terms: tuple[Term, ...] = ()
    held: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """Number of all parameters: Θ, constants, then every term's."""
        return self.structure.size + len(self.constants) + sum(term.size for term in self.terms)

    @property
    def steepness(self) -> Array:
        """K_v of every joint's friction, (n,) [s/rad or s/m]."""
        return np.array([terms.k_v for terms in self.structure.terms])

    def constant(self, place: int) -> float:
        """Present value of an estimated constant of the friction curve.

        Parameters
        ----------
        place : int
            among `constants`
        """
        joint, name = self.constants[place]
        terms = self.structure.terms[joint]
        return terms.k_v if name == "k_v" else terms.delta or 0.0

    def prior(self) -> tuple[Array, Array]:
        """Rows of the robot file's statements about the friction curve, (s, p), and what they leave, (s,).

        A stated constant counts as measured once, with a relative standard error of `STATED_ERROR`; a parameter that
        is held, as measured `HOLDING` times better than any data can.
        """
        rows, left = [], []
        for place in self.held:
            row = np.zeros(self.size)
            row[place] = HOLDING
            rows.append(row)
            left.append(0.0)
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

    def without_terms(self) -> "ExtendedModel":
        """The nominal part alone."""
        return replace(self, terms=())

    def sensitivity_columns(self, piece: Piece, joint: int) -> tuple[list[int], Array]:
        """∂τ/∂log K of a joint's own estimated constants, in the common band, (k, M), with their places.

        Parameters
        ----------
        piece : Piece
            from the observations
        joint : int
            joint index, from 0
        """
        places, rows = [], []
        velocity = piece.prepared.motion.velocity[:, joint]
        for place, (owner, name) in enumerate(self.constants):
            if owner == joint:
                column = self.structure.coefficient(joint, "stiction" if name == "k_v" else "stribeck")
                amplitude = 0.0 if column is None else self.parameters[column]
                value = self.constant(place)
                rows.append(amplitude * value * smooth_sign_slope(velocity, value))
                places.append(self.structure.size + place)
        if not rows:
            return places, np.zeros((0, piece.rows))
        return places, piece.prepared.motion.band.reduce(np.stack(rows))

    def standard_parameters(self) -> Array:
        """Standard parameters with the fitted base parameters, (10 n,): those in combinations only are zero."""
        base = self.structure.base
        standard = np.zeros_like(self.links)
        standard[base.independent_columns] = self.parameters[: self.structure.base_count]
        return standard

    def signals(self, piece: Piece) -> Signals:
        """One piece of motion with what the nominal part of the model says of it.

        Parameters
        ----------
        piece : Piece
            from the observations
        """
        kept: list[tuple[tuple[object, ...], Signals]] = piece.memory.setdefault("signals", [])
        key = (self.structure, self.parameters, self.links)
        for known, signals in kept:
            if all(a is b for a, b in zip(known, key, strict=True)):
                return signals
        signals = self._made_signals(piece)
        kept.append((key, signals))
        del kept[:-SIGNALS_KEPT]
        return signals

    def _made_signals(self, piece: Piece) -> Signals:
        """The same, made anew."""
        prepared, structure = piece.prepared, self.structure
        motion = prepared.motion
        bodies = np.where(np.arange(structure.size) < structure.base_count, self.parameters, 0.0)
        whole, rigid = prepared.predicted_torque(structure, np.stack([self.parameters, bodies]))
        steepness = self.steepness
        velocity = np.ascontiguousarray(motion.velocity.T)
        return Signals(
            robot=structure.robot,
            rate_hz=motion.rate_hz,
            time=piece.time,
            recording=prepared.recording,
            position=np.ascontiguousarray(motion.position.T),
            velocity=velocity,
            acceleration=np.ascontiguousarray(motion.acceleration.T),
            load=rigid,
            torque=whole,
            step=smooth_sign(velocity, steepness[:, None]),
            steepness=steepness,
            bodies=self.standard_parameters(),
            links=self.links,
            periodic=motion.repetitions > 1,
            of_motion=piece.memory.setdefault("of_motion", {}),
        )

    def term_torque(self, term: Term, signals: Signals) -> Array:
        """Torque of one term at the recorded rate, (m, N) or (m, P, N) for the joints that it touches.

        Parameters
        ----------
        term : Term
            of this model
        signals : Signals
            one piece of motion
        """
        (columns,) = term.effect.columns(signals, term.shape[None])
        return np.asarray(np.tensordot(term.coefficients, columns, axes=1), dtype=np.float64)

    def term_derivatives(self, term: Term, signals: Signals) -> Array:
        """Torque per unit of each of a term's parameters, (c + f, m, N) or (c + f, m, P, N).

        Parameters
        ----------
        term : Term
            of this model
        signals : Signals
            one piece of motion
        """
        steps = [shape_step(term, place) for place in term.free_shapes]
        shapes = [term.shape]
        for place, step in zip(term.free_shapes, steps, strict=True):
            for sign in (1.0, -1.0):
                moved = term.shape.copy()
                moved[place] += sign * step
                shapes.append(moved)
        columns = term.effect.columns(signals, np.stack(shapes))
        rows = [*columns[0]]
        for number, step in enumerate(steps):
            ahead, behind = columns[1 + 2 * number], columns[2 + 2 * number]
            rows.append(np.tensordot(term.coefficients, ahead - behind, axes=1) / (2.0 * step))
        return np.stack(rows)


def shape_step(term: Term, place: int) -> float:
    """Step of a shape parameter for its derivative.

    Parameters
    ----------
    term : Term
        the effect in the model
    place : int
        which of its shape parameters
    """
    effect = term.effect
    if effect.shapes[place].logarithmic:
        return DIFFERENCE * abs(float(term.shape[place]))
    return DIFFERENCE * 0.1 * float(effect.upper[place] - effect.lower[place]) + 1e-12


def predicted_rows(model: ExtendedModel, piece: Piece) -> Array:
    """The model's torque in the common band, all repetitions, (n, P M).

    Parameters
    ----------
    model : ExtendedModel
        the model
    piece : Piece
        from the observations
    """
    signals = model.signals(piece)
    total = piece.repeated(piece.prepared.motion.band.reduce(signals.torque))
    if model.terms:
        total = total.copy()
    for term in model.terms:
        touched = list(term.effect.touched(len(total)))
        total[touched] += piece.reduced(model.term_torque(term, signals))
    return total


def residual_rows(model: ExtendedModel, observations: Observations) -> list[list[Array]]:
    """Measured less modelled torque in the common band: per joint, per piece, (1, P M).

    Parameters
    ----------
    model : ExtendedModel
        the model
    observations : Observations
        the data
    """
    predicted = [predicted_rows(model, piece) for piece in observations]
    joints = range(observations.robot.joint_count)
    return [
        [measured - rows[joint] for measured, rows in zip(observations.torque(joint), predicted, strict=True)]
        for joint in joints
    ]


def raw_squares(model: ExtendedModel, observations: Observations) -> tuple[Array, Array]:
    """Σ e² and number of samples of every joint at the recorded rate, no filter, (n,) each.

    Parameters
    ----------
    model : ExtendedModel
        the model
    observations : Observations
        the data
    """
    count = observations.robot.joint_count
    squares, samples = np.zeros(count), np.zeros(count)
    for piece in observations:
        signals, motion = model.signals(piece), piece.prepared.motion
        predicted = np.repeat(signals.torque[:, None], piece.repetitions, axis=1)
        for term in model.terms:
            torque = term.effect.torque_of(signals, term.coefficients, term.shape)
            predicted[list(term.effect.touched(count))] += torque if torque.ndim == 3 else torque[:, None]
        own = motion.own
        measured = motion.torque[:, own].transpose(2, 0, 1)
        known = motion.measured[:, own].transpose(2, 0, 1)
        error = np.where(known, measured - predicted[..., own], 0.0)
        squares += np.einsum("jpt,jpt->j", error, error)
        samples += known.sum(axis=(1, 2))
    return squares, samples


def with_terms(model: ExtendedModel, terms: Sequence[Term]) -> ExtendedModel:
    """The same nominal part with other effects.

    Parameters
    ----------
    model : ExtendedModel
        the model
    terms : sequence of Term
        all effects
    """
    return replace(model, terms=tuple(terms))
