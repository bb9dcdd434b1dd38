"""Values of a shape parameter between the grid's points."""

import numpy as np

from tauscope.effects import Effect
from tauscope.recording.recording import Array

POINTS = 7  # values at once: two zooms of them are a hundredth of the grid's step


def neighbours(effect: Effect, shape: Array, place: int) -> tuple[float, float]:
    """The grid's values below and above the one at a place of `shape`, (k,), or its bounds."""
    values = np.unique(effect.grid[:, place])
    at = int(np.argmin(np.abs(values - shape[place])))
    low = values[at - 1] if at > 0 else effect.lower[place]
    high = values[at + 1] if at + 1 < len(values) else effect.upper[place]
    return float(low), float(high)


def spread(low: float, high: float, logarithmic: bool) -> Array:
    """`POINTS` values of a shape parameter, the ends among them, (p,)."""
    return np.geomspace(low, high, POINTS) if logarithmic else np.linspace(low, high, POINTS)
