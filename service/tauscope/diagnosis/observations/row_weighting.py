"""How much whitened rows count that the columns are not certain of, each by itself and many together.

The columns of row i are wrong by something of standard deviation u_i of its own, and by errors S (k, R) that all rows
share, each of unknown size with standard deviation 1. In units of the rows' noise their covariance is then

    W⁻² + W⁻¹ Sᵀ S W⁻¹,        W = diag(1/√(1 + u²)),

and W followed by (I + SᵀS)^(-1/2) makes them white again. The second factor differs from I in k directions only.
"""

from dataclasses import dataclass

import numpy as np

from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class RowWeighting:
    """What the rows of one joint are multiplied by."""

    weights: Array  # (R,), W: 1 where the columns are certain
    directions: Array  # (k, R), orthonormal, those of the shared errors among weighted rows
    shrinkage: Array  # (k,), share that is taken off along each: 0 where nothing is shared, 1 where nothing is left

    @staticmethod
    def of(weights: Array, shared: Array) -> "RowWeighting":
        """From `weights`, (R,), W, and `shared`, (k, R), S: each error at one std among weighted rows."""
        _, sizes, directions = np.linalg.svd(shared, full_matrices=False)
        return RowWeighting(weights, directions, 1.0 - 1.0 / np.sqrt(1.0 + sizes**2))

    def applied(self, rows: Array) -> Array:
        """Whitened rows as they count, (k, R). `rows`: (k, R), whitened rows."""
        weighted = rows * self.weights
        return weighted - ((weighted @ self.directions.T) * self.shrinkage) @ self.directions
