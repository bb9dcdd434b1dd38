"""Refinement of a model by shooting segments: Gauss-Newton from the torque estimate, with priors.

minimise Σ (q_sim - q)² / σ² + Σ ((x - x₀) / s)² over masses, centres of mass, friction, and friction by load.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tauscope.closed_loop.laws import LoadFriction
from tauscope.closed_loop.refinable import RefinableModel, Term
from tauscope.closed_loop.segments import STEP_S, Segments
from tauscope.export.model import ExportModel
from tauscope.recording import Recording
from tauscope.recording.recording import Array
from tauscope.robot import Actuator

INDEPENDENT_S = 0.1  # time between independent position errors [s]: loops of servos pass about 10 Hz
SIGNIFICANT = 0.05  # p above which a term of friction by load is left out
MOST_STEPS = 30  # Gauss-Newton steps at most
IMPROVES = 1e-4  # relative fall of the cost below which the search ends
DIFFERENCE = 0.02  # step of numerical derivatives, relative to the scale of a parameter


@dataclass(frozen=True)
class RefinedTerm:
    """A parameter after refinement: value, standard error, and p of no such term where a model does without it."""

    term: Term
    value: float
    std: float
    p_value: float | None


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined model; `before`, `after`: rms position error of the segments over all joints [rad or m]."""

    model: ExportModel
    friction: LoadFriction
    loops: tuple[Actuator, ...]  # with torque per volt that falls with temperature, where that was recorded
    terms: tuple[RefinedTerm, ...]
    left_out: tuple[str, ...]
    before: float
    after: float
    count: int


def refine_model(
    model: ExportModel,
    loops: Sequence[Actuator],
    recordings: Sequence[Recording],
    progress: Callable[[str], None] = lambda step: None,
) -> Refined:
    """Refine a model without findings by `loops` with delays. Raises RecordingError where no motion is long enough."""
    arm = RefinableModel(model, tuple(loops), Segments.of(recordings, loops))
    progress(f"refine {len(arm.terms)} parameters on {arm.segments.count} segments")
    optional = np.array([term.is_optional for term in arm.terms])
    start = np.array([term.start for term in arm.terms])
    scale = np.array([term.scale for term in arm.terms])
    before = _rms(arm.errors(start[None]))
    # Friction by load acts from the first step, as it has no derivative at its bound.
    values, free = np.where(optional, scale, start), np.ones(len(start), dtype=bool)
    while True:
        values, std = _minimise(arm, values, free)
        p_values = np.where(free & optional, 1.0 - ndtr(values / np.where(std > 0.0, std, np.inf)), 0.0)
        doubtful = p_values > SIGNIFICANT
        if not doubtful.any():
            break
        progress(f"leave out {', '.join(term.name for term, out in zip(arm.terms, doubtful, strict=True) if out)}")
        free, values = free & ~doubtful, np.where(doubtful, 0.0, values)
    refined, friction, own = arm.model_of(values)
    return Refined(
        model=refined,
        friction=friction,
        loops=own,
        terms=tuple(
            RefinedTerm(term, float(value), float(error), float(p) if term.is_optional else None)
            for term, value, error, p, is_free in zip(arm.terms, values, std, p_values, free, strict=True)
            if is_free
        ),
        left_out=tuple(term.name for place, term in enumerate(arm.terms) if not free[place]),
        before=before,
        after=_rms(arm.errors(values[None])),
        count=arm.segments.count,
    )


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _minimise(arm: RefinableModel, values: Array, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Levenberg-Marquardt over the free parameters: minimum and standard errors, (P,), σ by the present step."""
    terms, index = arm.terms, np.flatnonzero(free)
    scale = np.array([term.scale for term in terms])[index]
    start = np.array([term.start for term in terms])[index]
    prior = (scale / np.array([term.prior_std for term in terms])[index]) ** 2
    damping, std = 1e-2, np.zeros(len(values))
    moves = np.zeros((len(index), len(values)))
    moves[np.arange(len(index)), index] = DIFFERENCE * scale
    for _ in range(MOST_STEPS):
        found = arm.errors(np.vstack([values, values + moves]))
        errors, slopes = found[..., 0], (found[..., 1:] - found[..., :1]) / DIFFERENCE
        weight = STEP_S / INDEPENDENT_S / np.maximum(np.mean(errors**2, axis=(0, 2)), 1e-24)
        away = (values[index] - start) / scale
        hessian = np.einsum("j,kjsa,kjsb->ab", weight, slopes, slopes, optimize=True) + np.diag(prior)
        gradient = np.einsum("j,kjsa,kjs->a", weight, slopes, errors, optimize=True) + prior * away
        std[index] = scale * np.sqrt(np.maximum(np.diag(np.linalg.pinv(hessian, hermitian=True)), 0.0))
        levels = damping * 10.0 ** np.arange(-1.0, 4.0)
        tries = np.repeat(values[None], len(levels), axis=0)
        for place, level in enumerate(levels):
            damped = hessian + level * np.diag(np.diag(hessian) + 1e-9)
            tries[place, index] -= scale * np.linalg.solve(damped, gradient)
        tries = arm.clip(tries)
        squares = np.einsum("j,kjsv->v", weight, arm.errors(tries) ** 2)
        costs = squares + np.sum(prior * ((tries[:, index] - start) / scale) ** 2, axis=1)
        now = float(np.einsum("j,kjs->", weight, errors**2) + np.sum(prior * away**2))
        best = int(np.argmin(costs))
        if not costs[best] < (1.0 - IMPROVES) * now:
            break
        values, damping = tries[best], max(float(levels[best]), 1e-8)
    return values, std
