"""A Gauss–Newton step of everything at once, no farther than its curved parameters may go.

Where linear parameters Θ are fitted anew at every step, what limits a step is how far shapes and the constants of the
friction's curve may move: bounds of their own, and a trust region beyond which columns are no slopes any more. With
the unlimited step s and its covariance C, the energy near it is (x - s)ᵀ C⁻¹ (x - s); minimal over all else, of the
curved parameters k it is

    (x_k - s_k)ᵀ C_kk⁻¹ (x_k - s_k),        lo ≤ x_k ≤ hi,

and the rest follows as x = s + C_·k C_kk⁻¹ (x_k - s_k). Cutting each parameter's change short by itself would leave
a direction in which the energy need not fall.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from tauscope.recording.recording import Array

# Part of a curved parameter's variance that is added to it, so that two that are one can be solved for.
NEGLIGIBLE = 1e-12


def bounded_step(
    step: Array, spread: Array, curved: NDArray[np.intp], lower: Array, upper: Array, reach: Array
) -> Array:
    """The step that takes most off the energy within its limits, (p,).

    `step`: (p,), without limits; `spread`: (p, r), S with S Sᵀ the parameters' covariance; `curved`: (k,), places of
    the parameters that are limited; `lower`, `upper`: (k,), how far they may go, lower ≤ 0 ≤ upper; `reach`: (k,), how
    far of the same order each may go, above zero.
    """
    wanted = step[curved] / reach
    low, high = lower / reach, upper / reach
    if ((low <= wanted) & (wanted <= high)).all():
        return step
    own = spread[curved] / reach[:, None]
    moved = (np.linalg.norm(own, axis=1) > 0.0) & (high > low)
    covariance = own[moved] @ own[moved].T
    covariance[np.diag_indices_from(covariance)] *= 1.0 + NEGLIGIBLE
    root = np.linalg.cholesky(covariance)
    whitening = solve_triangular(root, np.eye(len(root)), lower=True)
    found = lsq_linear(whitening, whitening @ wanted[moved], bounds=(low[moved], high[moved]), method="bvls").x
    change = whitening.T @ (whitening @ (found - wanted[moved]))
    limited = step + spread @ (own[moved].T @ change)
    limited[curved] = 0.0  # a column of next to nothing asks for a step so long that its sum would be rounding
    limited[curved[moved]] = found * reach[moved]
    return limited
