"""Orders of a wave far from the one that was found that explain nearly as much: an interval knows of them too.

A standard error is the curvature at one optimum; over a narrow motion waves of several orders look alike. With T(k)
what a wave takes off the residual's energy at order k, σ the standard error of k̂, κ the factor by which the residual
exceeds the modelled noise, and nothing known of k beforehand, the chance of an order more than three σ away is

    p(k) dk = L(k) dk / (√(2π) σ + ∫ L dk'),        L(k) = exp((T(k) - T(k̂)) / 2κ).
"""

from dataclasses import replace

import numpy as np

from tauscope.diagnosis.findings.elsewhere import Elsewhere
from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.projection import statistics
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.screening.screen import SHAPES_AT_ONCE, Screen, model_signals
from tauscope.recording.recording import Array

APART = 3.0
"""Standard errors within which an order is the one that was found."""

BETWEEN = 0.2
"""Part of its height that a maximum may lose between the grid's points."""

NEGLIGIBLE = 20.0
"""Decrease of T, in units of κ, below which an order has no chance."""

PARTS = 8
"""Orders between two of the grid's."""


def orders_elsewhere(term: Term, error: float, without: Fit, screen: Screen, inflation: float) -> tuple[Elsewhere, ...]:
    """Orders of a wave beyond its own error, with their chances; empty for what is no wave, or of a known order."""
    effect = term.effect
    if not effect.repeats or not effect.is_free(0) or error <= 0.0:
        return ()
    signals = model_signals(without.model, screen.observations)

    def explained(orders: Array) -> tuple[Array, Array]:
        parts = []
        for first in range(0, len(orders), SHAPES_AT_ONCE):
            found = screen.at_shapes(effect, orders[first : first + SHAPES_AT_ONCE, None], without, signals)
            parts.append(statistics(found, [each.positive for each in effect.coefficients]))
        gains, coefficients = zip(*parts, strict=True)
        return np.concatenate(gains), np.concatenate(coefficients)

    best = float(explained(term.shape)[0][0])
    grid = np.unique(effect.grid[:, 0])
    worth = explained(grid)[0] > (1.0 - BETWEEN) * best - NEGLIGIBLE * inflation
    orders, steps = _between(grid, worth)
    apart = np.abs(orders - float(term.shape[0])) > APART * error
    if not apart.any():
        return ()
    orders, steps = orders[apart], steps[apart]
    gains, coefficients = explained(orders)
    chances = _chances(gains, best, steps, error, inflation)
    return tuple(
        Elsewhere(float(chance), replace(term, shape=order, coefficients=values))
        for chance, order, values in zip(chances, orders[:, None], coefficients, strict=True)
        if chance > 0.0
    )


def _between(grid: Array, worth: np.ndarray) -> tuple[Array, Array]:
    """Middles of the parts of those intervals of a grid that have an end worth looking at, and their widths."""
    chosen = np.flatnonzero(worth[:-1] | worth[1:])
    widths = np.diff(grid)[chosen] / PARTS
    middles = grid[chosen, None] + widths[:, None] * (np.arange(PARTS) + 0.5)
    return middles.ravel(), np.repeat(widths, PARTS)


def _chances(gains: Array, best: float, steps: Array, error: float, inflation: float) -> Array:
    """Chance of each order elsewhere."""
    fall = np.minimum(gains - best, 0.0) / inflation
    likelihood = np.where(fall > -NEGLIGIBLE, np.exp(0.5 * fall), 0.0) * steps
    return likelihood / (np.sqrt(2.0 * np.pi) * error + likelihood.sum())
