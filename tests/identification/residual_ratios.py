"""Held-out residuals over those that a result predicts."""

import numpy as np
from numpy.typing import NDArray

from tauscope.identification import IdentificationDocument

Array = NDArray[np.float64]


def ratios(found: IdentificationDocument) -> Array:
    """Held-out residual over the predicted one, (n,)."""
    held_out = found.fit.held_out
    assert held_out is not None
    assert held_out.predicted_rms is not None
    return np.array(held_out.rms) / np.array(held_out.predicted_rms)


def within(values: Array) -> float:
    """Share that lies within a factor of two."""
    return float(np.mean((values > 0.5) & (values < 2.0)))
