"""The extended model fitted to whitened rows by Gauss–Newton steps: Θ, K_v, δ, effects and their shapes together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from service.diagnosis.fitting.bounded_step import bounded_step
from service.diagnosis.fitting.projection import JointColumns, Projection, project
from service.diagnosis.model.extended import ExtendedModel, with_terms
from service.diagnosis.model.residual import residual_rows
from service.diagnosis.model.term import Term
from service.diagnosis.observations.observations import Observations, Piece
from service.recording.recording import Array

STEPS = 25
SETTLED = 0.05
"""Energy that a step takes or promises to take off, below which there is none to follow [noise variances]."""

LARGEST_LOG_STEP = 0.4
"""Change of a constant's logarithm in one step."""

SHAPE_STEP = 0.15
"""Change of a linear shape parameter in one step, relative to its bounds."""

TRUSTED = (1.0, 0.25, 0.06, 0.015)
"""Parts of those changes that are tried, one after the other, until less is left than before."""

FARTHEST = 3.0
"""Factor beyond which a constant of the friction curve does not move from where the identification found it."""

AT_LIMIT = 1e-6
"""Part of its largest step within which a constant or a shape is at its limit."""


@dataclass(frozen=True, eq=False)
class Fit:
    """An extended model at its optimum.

    model : ExtendedModel
        with fitted parameters
    projection : Projection
        of its columns there, without those that would lead out of their bounds; its residual is what one more linear
        step would leave
    energy : float
        Σ r² that the model leaves, the prior's included [noise variances]
    joint_energies : (n,) float64
        the same by joint, without the prior's
    spread : (p, r) float64
        square root of the covariance; a shape at its bound is as uncertain as if there were none
    """

    model: ExtendedModel
    projection: Projection
    energy: float
    joint_energies: Array
    spread: Array

    @property
    def covariance(self) -> Array:
        """Covariance of all parameters for white noise of the modelled size, (p, p)."""
        return self.spread @ self.spread.T

    def inflation(self, *, at_least: float = 1.0) -> float:
        """Residual energy per degree of freedom: what is left is more than the modelled noise by this factor.

        Parameters
        ----------
        at_least : float
            1 where the noise is known; less where its size is no more than a guess that the fit may correct
        """
        return max(at_least, self.energy / self.projection.freedom)


class Fitter:
    """Fits extended models to the same observations; columns that never change are whitened once.

    Parameters
    ----------
    observations : Observations
        the data, noise known
    """

    def __init__(self, observations: Observations) -> None:
        self.observations = observations
        self._rigid: dict[int, Array] = {}

    def fit(self, model: ExtendedModel, *, steps: int = STEPS) -> Fit:
        """Fit all parameters.

        Parameters
        ----------
        model : ExtendedModel
            where to start
        steps : int
            most Gauss–Newton steps
        """
        limits = _constants_limits(model)
        model, residual = self._linear_optimum(model)
        energy = _energy(model, residual)
        projection = self._project(self._columns(model), residual, model)
        for _ in range(steps):
            if energy - projection.energy < SETTLED:
                break
            tried = self._descended(model, projection, energy, limits)
            if tried is None:
                break
            model, residual = tried
            gained, energy = energy - _energy(model, residual), _energy(model, residual)
            projection = self._project(self._columns(model), residual, model)
            if gained < SETTLED:
                break
        projection, spread = self._within_limits(model, residual, projection, limits)
        return Fit(model, projection, energy, _energies(residual), spread)

    def _within_limits(
        self, model: ExtendedModel, residual: list[Array], projection: Projection, limits: Array
    ) -> tuple[Projection, Array]:
        """The projection without what would only lead beyond limits, and the spread of all parameters.

        What they would do beyond is nothing that the model can do; but nor does a shape's bound make it known.
        """
        stopped = _stopped(model, projection.step, limits)
        if not stopped:
            return projection, projection.spread
        columns, constants = self._columns(model), [place for place in stopped if _is_constant(model, place)]
        within = self._project(_without(columns, stopped), residual, model)
        if constants == stopped:
            return within, within.spread
        return within, self._project(_without(columns, constants), residual, model).spread

    def _descended(
        self, model: ExtendedModel, projection: Projection, energy: float, limits: Array
    ) -> tuple[ExtendedModel, list[Array]] | None:
        """The longest step after which no more is left than before, as `_linear_optimum` gives it."""
        curved, lower, upper, reach = _room(model, limits)
        for trusted in TRUSTED:
            low, high = np.maximum(lower, -trusted * reach), np.minimum(upper, trusted * reach)
            step = bounded_step(projection.step, projection.spread, curved, low, high, reach)
            tried = self._linear_optimum(_stepped(model, step))
            if _energy(*tried) <= energy * (1.0 + 1e-12):
                return tried
        return None

    def _linear_optimum(self, model: ExtendedModel) -> tuple[ExtendedModel, list[Array]]:
        """The model with the best Θ and coefficients for its shapes, and its residual.

        A step in a shape that is cut short would else leave coefficients that belong to another shape.
        """
        residual, columns = self._linearised(model)
        linear = np.ones(model.size, dtype=bool)
        linear[model.structure.size : model.structure.size + len(model.constants)] = False
        linear[list(model.unmoved)] = False
        for term, place in zip(model.terms, model.term_places(), strict=True):
            linear[place.start + len(term.coefficients) : place.stop] = False
        kept = [linear[own.index] for own in columns]
        places = np.cumsum(linear) - 1
        own = [
            JointColumns(places[each.index[mask]], each.rows[mask]) for each, mask in zip(columns, kept, strict=True)
        ]
        found = project(own, residual, int(linear.sum()))
        step = np.zeros(model.size)
        step[linear] = found.step
        moved = _stepped(model, step)
        if model.terms:  # their columns may depend on Θ
            return moved, self._residual(moved)
        return moved, list(found.residual)

    def projected(self, model: ExtendedModel) -> Fit:
        """The linear step at a model as it is, without moving it.

        Parameters
        ----------
        model : ExtendedModel
            the model
        """
        residual, columns = self._linearised(model)
        projection = self._project(columns, residual, model)
        return Fit(model, projection, projection.energy, _energies(projection.residual), projection.spread)

    def covariance(self, fit: Fit) -> Array:
        """Covariance of all parameters, those that a term displaced as uncertain as they would be without that, (p, p).

        Parameters
        ----------
        fit : Fit
            the model at its optimum
        """
        if not any(term.displaced for term in fit.model.terms):
            return fit.covariance
        return self.projected(with_terms(fit.model, [replace(t, displaced=()) for t in fit.model.terms])).covariance

    def white_residual(self, model: ExtendedModel) -> list[Array]:
        """Whitened residual of a model as it is, (R_j,) a joint.

        Parameters
        ----------
        model : ExtendedModel
            the model
        """
        return self._residual(model)

    def columns(self, model: ExtendedModel) -> list[JointColumns]:
        """Whitened columns of all parameters of a model, one entry a joint.

        Parameters
        ----------
        model : ExtendedModel
            the model
        """
        return self._columns(model)

    def _project(self, columns: list[JointColumns], residual: list[Array], model: ExtendedModel) -> Projection:
        noise = self.observations.noise
        rows = sum(own.share * len(row) for own, row in zip(noise, residual, strict=True))
        return replace(project(columns, residual, model.size, model.prior()), independent=rows)

    def _linearised(self, model: ExtendedModel) -> tuple[list[Array], list[JointColumns]]:
        return self._residual(model), self._columns(model)

    def _residual(self, model: ExtendedModel) -> list[Array]:
        rows = residual_rows(model, self.observations)
        return [self.observations.white(joint, pieces)[0] for joint, pieces in enumerate(rows)]

    def _columns(self, model: ExtendedModel) -> list[JointColumns]:
        observations = self.observations
        pieces = [_moving_columns(model, piece) for piece in observations]
        result = []
        for joint in range(observations.robot.joint_count):
            rigid = model.factor(joint) * self._white_rigid(model, joint)
            moving = observations.white(joint, [piece[joint].rows for piece in pieces])
            places = [model.structure.joint_columns(joint)[: len(rigid)], pieces[0][joint].index]
            result.append(JointColumns(np.concatenate(places).astype(np.intp), np.concatenate([rigid, moving])))
        return result

    def _white_rigid(self, model: ExtendedModel, joint: int) -> Array:
        """Columns of the links, which no fit changes."""
        if joint not in self._rigid:
            own = len(model.structure.terms[joint].names)
            columns = [piece.prepared.joint_columns(model.structure, joint)[:-own] for piece in self.observations]
            rows = [piece.repeated(each) for piece, each in zip(self.observations, columns, strict=True)]
            self._rigid[joint] = self.observations.white(joint, rows)
        return self._rigid[joint]


def _moving_columns(model: ExtendedModel, piece: Piece) -> list[JointColumns]:
    """Columns of one piece that change with the model, in the common band: friction, its constants, and all terms."""
    motion, structure = piece.prepared.motion, model.structure
    joints = range(structure.robot.joint_count)
    rows: list[list[Array]] = [[] for _ in joints]
    places: list[list[int]] = [[] for _ in joints]
    for joint in joints:
        terms = structure.joint_term_columns(joint, motion.velocity[:, joint], motion.acceleration[:, joint])
        factor = model.factor(joint)
        rows[joint].append(piece.repeated(factor * motion.band.reduce(terms)))
        places[joint] += list(structure.joint_columns(joint)[-len(terms) :])
        of_constants, slopes = model.sensitivity_columns(piece, joint)
        rows[joint].append(_with_steps_of_terms(piece.repeated(factor * slopes), of_constants, joint, model, piece))
        places[joint] += of_constants
    for term, place in zip(model.terms, model.term_places(), strict=True):
        derivatives = model.term_derivatives(term, model.signals(piece))
        for slot, joint in enumerate(term.effect.touched(len(joints))):
            rows[joint].append(piece.reduced(derivatives[:, slot]))
            places[joint] += list(range(place.start, place.stop))
    return [JointColumns(np.array(index), np.concatenate(own)) for index, own in zip(places, rows, strict=True)]


def _with_steps_of_terms(slopes: Array, places: list[int], joint: int, model: ExtendedModel, piece: Piece) -> Array:
    """∂τ/∂log K of a joint's constants, and what K_v changes of the terms there that have friction's step in them."""
    stepping = [term for term in model.terms if term.effect.has_step and term.effect.joint == joint]
    for row, place in enumerate(places):
        if model.constants[place - model.structure.size] == (joint, "k_v"):
            for term in stepping:
                slopes[row] += piece.reduced(model.step_sensitivity(term, model.signals(piece)))[0]
    return slopes


def _energies(residual: Sequence[Array]) -> Array:
    """Σ r² by joint, (n,)."""
    return np.array([float(row @ row) for row in residual])


def _energy(model: ExtendedModel, residual: list[Array]) -> float:
    """Σ r² of the data's rows and of the prior's."""
    _, left = model.prior()
    return float(_energies(residual).sum() + left @ left)


def _constants_limits(model: ExtendedModel) -> Array:
    """Logarithms of the lowest and highest value of every constant of the friction curve, (c, 2)."""
    start = np.log([model.constant(place) for place in range(len(model.constants))])
    return np.stack([start - np.log(FARTHEST), start + np.log(FARTHEST)], axis=-1)


def _stopped(model: ExtendedModel, step: Array, limits: Array) -> list[int]:
    """Places of the constants and shapes that would move on beyond their limits."""
    curved, lower, upper, reach = _room(model, limits)
    wanted, near = step[curved], AT_LIMIT * reach
    return [int(place) for place in curved[((wanted < 0.0) & (lower > -near)) | ((wanted > 0.0) & (upper < near))]]


def _is_constant(model: ExtendedModel, place: int) -> bool:
    """Whether a parameter is one of the friction curve's constants."""
    return 0 <= place - model.structure.size < len(model.constants)


def _without(columns: list[JointColumns], places: list[int]) -> list[JointColumns]:
    """The same with nothing in the columns of some parameters."""
    return [JointColumns(own.index, np.where(np.isin(own.index, places)[:, None], 0.0, own.rows)) for own in columns]


def _room(model: ExtendedModel, limits: Array) -> tuple[NDArray[np.intp], Array, Array, Array]:
    """Places of constants and shapes, how far each may go down and up, and how far in one step, (k,) each."""
    first = model.structure.size
    rows = [
        (first + place, *(limits[place] - np.log(model.constant(place))), LARGEST_LOG_STEP)
        for place in range(len(model.constants))
    ]
    for term, place in zip(model.terms, model.term_places(), strict=True):
        effect, count = term.effect, len(term.coefficients)
        for number, free in enumerate(term.free_shapes):
            value = float(term.shape[free])
            low, high = float(effect.lower[free]) - value, float(effect.upper[free]) - value
            rows.append((place.start + count + number, low, high, _largest_move(term, free)))
    told = np.array(rows, dtype=np.float64).reshape(-1, 4)
    return told[:, 0].astype(np.intp), np.minimum(told[:, 1], 0.0), np.maximum(told[:, 2], 0.0), told[:, 3]


def _stepped(model: ExtendedModel, step: Array) -> ExtendedModel:
    """The model moved by a step; rounding leads no shape out of its bounds."""
    size = model.structure.size
    terms = list(model.structure.terms)
    for place, (joint, name) in enumerate(model.constants):
        if step[size + place]:
            terms[joint] = replace(terms[joint], **{name: model.constant(place) * float(np.exp(step[size + place]))})
    moved = []
    for term, place in zip(model.terms, model.term_places(), strict=True):
        count = len(term.coefficients)
        shape = term.shape.copy()
        free = list(term.free_shapes)
        shape[free] = np.clip(shape[free] + step[place][count:], term.effect.lower[free], term.effect.upper[free])
        moved.append(replace(term, shape=shape, coefficients=term.coefficients + step[place][:count]))
    stepped = replace(
        model, structure=model.structure.with_terms(tuple(terms)), parameters=model.parameters + step[:size]
    )
    return with_terms(stepped, moved)


def _largest_move(term: Term, place: int) -> float:
    """How far one step may move a shape parameter."""
    if term.effect.shapes[place].logarithmic:
        return max(LARGEST_LOG_STEP * abs(float(term.shape[place])), np.finfo(float).tiny)
    return max(SHAPE_STEP * float(term.effect.upper[place] - term.effect.lower[place]), np.finfo(float).tiny)
