"""The extended model fitted to whitened rows by Gauss–Newton steps: Θ, K_v, δ, effects and their shapes together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.fitting.bounded_step import bounded_step
from tauscope.diagnosis.fitting.projection import JointColumns, Projection, fitted_parameters, project
from tauscope.diagnosis.fitting.white_columns import WhiteColumns
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.observations.observations import Observations
from tauscope.recording.recording import Array

STEPS = 25
# Energy that a step takes or promises to take off, below which there is none to follow [noise variances].
SETTLED = 0.05
LARGEST_LOG_STEP = 0.4  # change of a constant's logarithm in one step
SHAPE_STEP = 0.15  # change of a linear shape parameter in one step, relative to its bounds
# Parts of those changes that are tried, one after the other, until less is left than before.
TRUSTED = (1.0, 0.25, 0.06, 0.015)
# Factor beyond which a constant of the friction curve does not move from where the identification found it.
FARTHEST = 3.0
AT_LIMIT = 1e-6  # part of its largest step within which a constant or a shape is at its limit


@dataclass(frozen=True, eq=False)
class Fit:
    """An extended model at its optimum."""

    model: ExtendedModel
    projection: Projection
    energy: float  # Σ r² that the model leaves, the prior's included [noise variances]
    spread: Array  # (p, r), square root of the covariance; a shape at its bound is as uncertain as if there were none

    @property
    def covariance(self) -> Array:
        """Covariance of all parameters for white noise of the modelled size, (p, p)."""
        return self.spread @ self.spread.T

    @property
    def free_parameters(self) -> Array:
        """Θ as the data alone have it, (p,)."""
        return self.model.parameters + self.projection.step[: self.model.structure.size]

    @property
    def free_covariance(self) -> Array:
        """Covariance of all parameters as the data alone have it, (p, p)."""
        return self.projection.spread @ self.projection.spread.T

    def inflation(self) -> float:
        """Residual energy per degree of freedom, at least 1: by this factor more is left than the modelled noise."""
        return max(1.0, self.energy / self.projection.freedom)


@dataclass(frozen=True, eq=False)
class Tried:
    """A model as it is."""

    model: ExtendedModel
    residual: list[Array]  # list of (R_j,), what it leaves, whitened

    @property
    def energy(self) -> float:
        """Σ r² of the data's rows and of the prior's."""
        _, left = self.model.prior()
        return float(sum(row @ row for row in self.residual) + left @ left)


class Fitter:
    """Fits extended models to the same observations."""

    def __init__(self, observations: Observations) -> None:
        self.observations = observations
        self._white = WhiteColumns(observations)

    def fit(self, model: ExtendedModel) -> Fit:
        """Fit all parameters."""
        limits = _constants_limits(model)
        at = self.linear_optimum(model)
        projection = self._project(at)
        for _ in range(STEPS):
            if at.energy - projection.energy < SETTLED:
                break
            tried = self._descended(at, projection, limits)
            if tried is None:
                break
            gained, at = at.energy - tried.energy, tried
            projection = self._project(at)
            if gained < SETTLED:
                break
        projection, spread = self._within_limits(at, projection, limits)
        return Fit(at.model, projection, at.energy, spread)

    def _within_limits(self, at: Tried, projection: Projection, limits: Array) -> tuple[Projection, Array]:
        """The projection without what would only lead beyond limits, and the spread of all parameters.

        What they would do beyond is nothing that the model can do; but nor does a shape's bound make it known.
        """
        stopped = _stopped(at.model, projection.step, limits)
        if not stopped:
            return projection, projection.spread
        constants = [place for place in stopped if _is_constant(at.model, place)]
        within = self._project(at, but=stopped)
        if constants == stopped:
            return within, within.spread
        return within, self._project(at, but=constants).spread

    def _descended(self, at: Tried, projection: Projection, limits: Array) -> Tried | None:
        """The longest step after which no more is left than before, as `linear_optimum` gives it."""
        curved, lower, upper, reach = _room(at.model, limits)
        last = None
        for trusted in TRUSTED:
            low, high = np.maximum(lower, -trusted * reach), np.minimum(upper, trusted * reach)
            step = bounded_step(projection.step, projection.spread, curved, low, high, reach)
            if last is not None and np.array_equal(step, last):
                continue  # it was within these limits before
            tried, last = self.linear_optimum(stepped(at.model, step)), step
            if tried.energy <= at.energy * (1.0 + 1e-12):
                return tried
        return None

    def linear_optimum(self, model: ExtendedModel) -> Tried:
        """The model with the best Θ and coefficients for its shapes.

        A step in a shape that is cut short would else leave coefficients that belong to another shape.
        """
        at = self._tried(model)
        linear = np.ones(model.size, dtype=bool)
        linear[model.structure.size : model.structure.size + len(model.constants)] = False
        for term, place in zip(model.terms, model.term_places(), strict=True):
            linear[place.start + len(term.coefficients) : place.stop] = False
        places = np.cumsum(linear) - 1
        columns = [(own, linear[own.index]) for own in self._white.linear(model)]
        free = [JointColumns(places[own.index[moves]], own.rows[moves]) for own, moves in columns]
        step = np.zeros(model.size)
        step[linear] = fitted_parameters(free, at.residual, int(linear.sum()))
        return self._tried(stepped(model, step))

    def projected(self, model: ExtendedModel) -> Fit:
        """The linear step at a model as it is, without moving it."""
        projection = self._project(self._tried(model))
        return Fit(model, projection, projection.energy, projection.spread)

    def white_residual(self, model: ExtendedModel) -> list[Array]:
        """Whitened residual of a model as it is, (R_j,) a joint."""
        return self._white.residual(model)

    def columns(self, model: ExtendedModel) -> list[JointColumns]:
        """Whitened columns of all parameters of a model, one entry a joint."""
        return self._white.all(model)

    def _tried(self, model: ExtendedModel) -> Tried:
        return Tried(model, self._white.residual(model))

    def _project(self, at: Tried, but: Sequence[int] = ()) -> Projection:
        """The linear step at a model, in all parameters but some."""
        noise = self.observations.noise
        rows = sum(own.share * len(row) for own, row in zip(noise, at.residual, strict=True))
        columns = _without(self._white.all(at.model), but)
        return replace(project(columns, at.residual, at.model.size, at.model.prior()), independent=rows)


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


def _without(columns: list[JointColumns], places: Sequence[int]) -> list[JointColumns]:
    """The same with nothing in the columns of some parameters."""
    if not places:
        return columns
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


def stepped(model: ExtendedModel, step: Array) -> ExtendedModel:
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
    stepped = replace(
        model, structure=model.structure.with_terms(tuple(terms)), parameters=model.parameters + step[:size]
    )
    return with_terms(stepped, moved)


def _largest_move(term: Term, place: int) -> float:
    """How far one step may move a shape parameter."""
    if term.effect.shapes[place].logarithmic:
        return max(LARGEST_LOG_STEP * abs(float(term.shape[place])), np.finfo(float).tiny)
    return max(SHAPE_STEP * float(term.effect.upper[place] - term.effect.lower[place]), np.finfo(float).tiny)
