"""Shape parameters between the grid's points: no two forms are compared before each is at its own best."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.projection import statistics
from tauscope.diagnosis.screening.screen import Candidate, Screen
from tauscope.effects import Effect, Signals
from tauscope.recording.recording import Array

POINTS = 7
ZOOMS = 3


def refined(candidate: Candidate, fit: Fit, screen: Screen, signals: Sequence[Signals]) -> Candidate:
    """The candidate at the best shape near its grid point, or near the same in another form."""
    kinds = refined_kinds(candidate, fit, screen, signals)
    effect, shapes = candidate.effect, np.array([each.shape for each in kinds])
    worth = np.array([each.gain for each in kinds]) - effect.reluctance(shapes)
    preferable = effect.preferable(np.array([each.coefficients for each in kinds]), shapes)
    return kinds[int(np.argmax(np.where(preferable, worth, -np.inf)))]


def refined_kinds(candidate: Candidate, fit: Fit, screen: Screen, signals: Sequence[Signals]) -> list[Candidate]:
    """The candidate at the best shape near its grid point, then at the best near the same of each other kind."""

    def best_of(shapes: Array) -> tuple[int, Candidate]:
        return best_of_shapes(candidate, candidate.effect, shapes, fit, screen, signals)

    nearby = _zoomed(candidate, best_of)
    return [nearby, *(_zoomed(best_of(shapes)[1], best_of) for shapes in candidate.effect.alike(nearby.shape))]


def best_of_shapes(
    candidate: Candidate, effect: Effect, shapes: Array, fit: Fit, screen: Screen, signals: Sequence[Signals]
) -> tuple[int, Candidate]:
    """Which of some shapes of a form explains most, and the candidate there.

    Parameters
    ----------
    shapes : (g, k) float64
        values of its shape parameters
    """
    found = screen.at_shapes(effect, shapes, fit, signals)
    gains, coefficients = statistics(found, [each.positive for each in effect.coefficients])
    best = int(np.argmax(np.where(effect.preferable(coefficients, shapes), gains, -np.inf)))
    return best, replace(
        candidate,
        effect=effect,
        shape=shapes[best],
        coefficients=coefficients[best],
        gain=float(gains[best]),
        gram=found.gram[best],
    )


def _zoomed(candidate: Candidate, best_of: Callable[[Array], tuple[int, Candidate]]) -> Candidate:
    """One shape parameter after the other between its neighbours on the grid."""
    effect = candidate.effect
    for place in filter(effect.is_free, range(len(effect.shapes))):
        low, high = neighbours(effect, candidate.shape, place)
        for _ in range(ZOOMS):
            values = spread(low, high, effect.shapes[place].logarithmic)
            shapes = np.tile(candidate.shape, (POINTS, 1))
            shapes[:, place] = values
            best, found = best_of(shapes)
            low, high = float(values[max(best - 1, 0)]), float(values[min(best + 1, POINTS - 1)])
            if found.gain > candidate.gain:
                candidate = found
    return candidate


def neighbours(effect: Effect, shape: Array, place: int) -> tuple[float, float]:
    """The grid's values of a shape parameter below and above, or its bounds.

    Parameters
    ----------
    shape : (k,) float64
        values of all shape parameters
    place : int
        of the one among them
    """
    values = np.unique(effect.grid[:, place])
    at = int(np.argmin(np.abs(values - shape[place])))
    low = values[at - 1] if at > 0 else effect.lower[place]
    high = values[at + 1] if at + 1 < len(values) else effect.upper[place]
    return float(low), float(high)


def spread(low: float, high: float, logarithmic: bool) -> Array:
    """`POINTS` values of a shape parameter, the ends among them, (p,)."""
    return np.geomspace(low, high, POINTS) if logarithmic else np.linspace(low, high, POINTS)
