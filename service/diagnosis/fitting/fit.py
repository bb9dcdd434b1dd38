"""The extended model fitted to whitened rows by Gauss–Newton steps: Θ, K_v, δ, effects and their shapes together."""

from dataclasses import dataclass, replace

import numpy as np

from service.diagnosis.fitting.projection import JointColumns, Projection, project
from service.diagnosis.model.extended import ExtendedModel, with_terms
from service.diagnosis.model.residual import residual_rows
from service.diagnosis.model.term import Term
from service.diagnosis.observations.observations import Observations, Piece
from service.recording.recording import Array

STEPS = 8
SETTLED = 1e-4
"""Change of the residual's energy, in noise variances a step, relative to all rows, that is the end."""

LARGEST_LOG_STEP = 0.4
"""Change of a constant's logarithm in one step."""

SHAPE_STEP = 0.15
"""Change of a linear shape parameter in one step, relative to its bounds."""

HALVINGS = 4

FARTHEST = 3.0
"""Factor beyond which a constant of the friction curve does not move from where the identification found it."""


@dataclass(frozen=True, eq=False)
class Fit:
    """An extended model at its optimum.

    model : ExtendedModel
        with fitted parameters
    projection : Projection
        of its columns at the optimum; the residual is what is left after the last linear step
    """

    model: ExtendedModel
    projection: Projection

    @property
    def energy(self) -> float:
        """Whitened residual's Σ r²."""
        return self.projection.energy

    @property
    def covariance(self) -> Array:
        """Covariance of all parameters for white noise of the modelled size, (p, p)."""
        return self.projection.spread @ self.projection.spread.T

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
        start = [model.constant(place) for place in range(len(model.constants))]
        model, residual, columns = self._linear_optimum(model)
        rows = sum(len(row) for row in residual)
        energy = _energy(model, residual)
        projection = self._project(columns, residual, model)
        for _ in range(steps):
            tried = self._descended(model, projection.step, energy, start)
            if tried is None:
                break
            model, residual, columns = tried
            gained, energy = energy - _energy(model, residual), _energy(model, residual)
            projection = self._project(columns, residual, model)
            if gained < SETTLED * rows and not _moves(model, projection.step):
                break
        return Fit(model, projection)

    def _descended(
        self, model: ExtendedModel, step: Array, energy: float, start: list[float]
    ) -> tuple[ExtendedModel, list[Array], list[JointColumns]] | None:
        """The first part of a step after which no more is left than before, as `_linear_optimum` gives it."""
        for halving in range(HALVINGS):
            tried = self._linear_optimum(_stepped(model, step, 0.5**halving, start))
            if _energy(tried[0], tried[1]) <= energy * (1.0 + 1e-12):
                return tried
        return None

    def _linear_optimum(self, model: ExtendedModel) -> tuple[ExtendedModel, list[Array], list[JointColumns]]:
        """The model with the best Θ and coefficients for its shapes, its residual, and columns of all parameters.

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
        moved = _stepped(model, step, 1.0, [])
        if model.terms:  # their columns may depend on Θ
            return moved, self._residual(moved), columns
        return moved, list(found.residual), columns

    def projected(self, model: ExtendedModel) -> Fit:
        """The linear step at a model as it is, without moving it.

        Parameters
        ----------
        model : ExtendedModel
            the model
        """
        residual, columns = self._linearised(model)
        return Fit(model, self._project(columns, residual, model))

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


def _energy(model: ExtendedModel, residual: list[Array]) -> float:
    """Σ r² of the data's rows and of the prior's."""
    _, left = model.prior()
    return sum(float(row @ row) for row in residual) + float(left @ left)


def _moves(model: ExtendedModel, step: Array) -> bool:
    """Whether the next step would still move a shape."""
    first = model.structure.size
    constants = step[first : first + len(model.constants)]
    if len(constants) and np.abs(constants).max() > 0.02:
        return True
    for term, place in zip(model.terms, model.term_places(), strict=True):
        of_shapes = step[place][len(term.coefficients) :]
        span = (term.effect.upper - term.effect.lower)[term.free_shapes]
        if len(of_shapes) and (np.abs(of_shapes) > 2e-3 * span).any():
            return True
    return False


def _stepped(model: ExtendedModel, step: Array, share: float, start: list[float]) -> ExtendedModel:
    """The model moved by part of a Gauss–Newton step, shapes within their bounds."""
    size = model.structure.size
    terms = list(model.structure.terms)
    for place, (joint, name) in enumerate(model.constants):
        if not step[size + place]:
            continue
        change = float(np.clip(share * step[size + place], -LARGEST_LOG_STEP, LARGEST_LOG_STEP))
        value = float(np.clip(model.constant(place) * np.exp(change), start[place] / FARTHEST, start[place] * FARTHEST))
        terms[joint] = replace(terms[joint], **{name: value})
    moved = []
    for term, place in zip(model.terms, model.term_places(), strict=True):
        own = share * step[place]
        count = len(term.coefficients)
        shape = term.shape.copy()
        for free, change in zip(term.free_shapes, own[count:], strict=True):
            shape[free] = _moved_shape(term, free, float(change))
        moved.append(replace(term, shape=shape, coefficients=term.coefficients + own[:count]))
    stepped = replace(
        model, structure=model.structure.with_terms(tuple(terms)), parameters=model.parameters + share * step[:size]
    )
    return with_terms(stepped, moved)


def _moved_shape(term: Term, place: int, change: float) -> float:
    """A shape parameter after a step that is neither too long nor leaves its bounds."""
    effect, value, bound = term.effect, float(term.shape[place]), _largest_move(term, place)
    return float(np.clip(value + np.clip(change, -bound, bound), effect.lower[place], effect.upper[place]))


def _largest_move(term: Term, place: int) -> float:
    """How far one step may move a shape parameter."""
    if term.effect.shapes[place].logarithmic:
        return max(LARGEST_LOG_STEP * abs(float(term.shape[place])), np.finfo(float).tiny)
    return SHAPE_STEP * float(term.effect.upper[place] - term.effect.lower[place])
