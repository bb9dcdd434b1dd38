"""The 4x4 pseudo-inertia as clarabel's cone wants it, and the magnitude of its entries.

J = ∫ [r; 1] [r; 1]ᵀ dm is positive definite if and only if m > 0 and the inertia about the centre of mass is positive
definite and keeps the triangle inequalities. Source: P. M. Wensing, S. Kim, J.-J. E. Slotine, "Linear matrix
inequalities for physically consistent inertial parameter identification", IEEE RA-L 3(1), 2018, equation (11).
"""

import numpy as np

from tauscope.robot import LinkInertia, pseudo_inertia
from tauscope.robot.robot import Array

# Entries of a symmetric 4x4 matrix, upper triangle column by column: the order of clarabel's PSDTriangleConeT.
UPPER_TRIANGLE = tuple((row, column) for column in range(4) for row in range(column + 1))
_ROWS, _COLUMNS = np.array(UPPER_TRIANGLE).T


def triangle_of_parameters() -> Array:
    """Matrix B, (10, 10), with svec(J) = B Θ, rows as `UPPER_TRIANGLE`, columns as `STANDARD_PARAMETERS`.

    Off-diagonal entries carry √2, so that ⟨svec(X), svec(Y)⟩ = tr(X Y), as clarabel's PSDTriangleConeT wants it.
    """
    weight = np.where(_ROWS == _COLUMNS, 1.0, np.sqrt(2.0))
    units = (pseudo_inertia(LinkInertia.from_vector(unit)) for unit in np.eye(10))
    return np.stack([weight * unit[_ROWS, _COLUMNS] for unit in units], axis=1)


def congruence(transform: Array) -> Array:
    """Matrix K, (10, 10), with svec(T X Tᵀ) = K svec(X); `transform`: (4, 4), T."""
    weight = np.where(_ROWS == _COLUMNS, 1.0, np.sqrt(2.0))
    both = transform[_ROWS][:, _ROWS] * transform[_COLUMNS][:, _COLUMNS]
    crossed = transform[_ROWS][:, _COLUMNS] * transform[_COLUMNS][:, _ROWS]
    return np.outer(weight, 1.0 / weight) * np.where(_ROWS == _COLUMNS, both, both + crossed)


def identity_triangle() -> Array:
    """Scaled upper triangle of the 4x4 identity. Returns (10,), in the order of `UPPER_TRIANGLE`."""
    return np.eye(4)[_ROWS, _COLUMNS]


def parameter_scale(mass: float, length: float) -> Array:
    """Magnitudes m, m ℓ and m ℓ² of a link's standard parameters, (10,); m [kg], ℓ [m]."""
    return mass * np.array([length**2] * 6 + [1.0] + [length] * 3)
