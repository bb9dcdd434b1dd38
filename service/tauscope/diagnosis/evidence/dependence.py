"""How many rows count as one, where torque that a model leaves is as slow as the motion.

The sum of N rows whose neighbours are alike varies as that of N/κ independent ones,

    κ = Σ_k γ_k / γ_0 = (1 - Σ a)⁻² σ² / γ_0

for an autoregression a with innovations of variance σ². Without repetitions of the motion nothing tells coloured noise
from physics that nobody thought of: both make the rows that there are say less.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Array

ORDER = 8  # predecessors that a row may resemble: with three, the edge of a low pass doubles κ of white noise behind it
RIDGE = 0.01  # part of the rows' power that is added to the autocovariance at lag 0, so that κ stays finite
BROKEN = 1.5  # time between two rows, in usual ones, from which the second does not follow the first


@dataclass(frozen=True, eq=False)
class Succession:
    """Which rows of a joint follow one another."""

    bounds: tuple[tuple[int, int], ...]  # first row of each unbroken stretch, and the row after its last

    @staticmethod
    def of(recording: NDArray[np.intp], instants: Array) -> "Succession":
        """From the recording and the instant of every row."""
        steps = np.diff(instants)
        usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 1.0
        broken = (np.diff(recording) != 0) | (steps <= 0.0) | (steps > BROKEN * usual)
        edges = [0, *(int(edge) + 1 for edge in np.flatnonzero(broken)), len(instants)]
        return Succession(tuple(pairwise(edges)))

    def dependence(self, rows: Array) -> float:
        """κ of rows (R,), at least 1."""
        covariance = np.zeros(ORDER + 1)
        for first, last in self.bounds:
            own = rows[first:last]
            covariance += [
                float(own[lag:] @ own[: len(own) - lag]) if lag < len(own) else 0.0 for lag in range(ORDER + 1)
            ]
        if covariance[0] <= 0.0:
            return 1.0
        covariance[0] *= 1.0 + RIDGE
        lags = np.abs(np.subtract.outer(np.arange(ORDER), np.arange(ORDER)))
        found = np.linalg.solve(covariance[lags], covariance[1:])
        innovation = 1.0 - float(found @ covariance[1:]) / covariance[0]
        return max(innovation / (1.0 - float(found.sum())) ** 2, 1.0)
