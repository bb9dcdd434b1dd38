"""Bounds on masses and their centres, as further rows of the conic program."""

import numpy as np
from numpy.typing import NDArray

from tauscope.identification.consistency.inequalities import LinearInequalities
from tauscope.robot import STANDARD_PARAMETERS

Array = NDArray[np.float64]

_MASS = STANDARD_PARAMETERS.index("m")
_FIRST_MOMENT = STANDARD_PARAMETERS.index("msx")


def centre_of_mass_inequalities(
    link: int, lower: Array, upper: Array, size: int, name: str | None = None
) -> LinearInequalities:
    """A link's centre of mass s inside a box: lo ≤ s ≤ hi, linear as m lo ≤ m s ≤ m hi.

    Parameters
    ----------
    link : int
        index of the link, from 0
    lower, upper : (3,) float64
        corners of the box in the link frame [m]; ±inf leaves an axis free
    """
    label = name or f"link {link + 1}"
    rows, names = [], []
    for axis, letter in enumerate("xyz"):
        for bound, sign, relation in ((lower[axis], -1.0, "≥"), (upper[axis], 1.0, "≤")):
            if np.isfinite(bound):
                row = np.zeros(size)
                row[10 * link + _FIRST_MOMENT + axis] = sign
                row[10 * link + _MASS] = -sign * bound
                rows.append(row)
                names.append(f"centre of mass {letter} of {label} {relation} {bound:g} m")
    return LinearInequalities(np.array(rows).reshape(-1, size), np.zeros(len(rows)), tuple(names))


def mass_inequalities(
    link: int, lower: float | None, upper: float | None, size: int, name: str | None = None
) -> LinearInequalities:
    """A link's mass between two bounds: lo ≤ m ≤ hi.

    Parameters
    ----------
    link : int
        index of the link, from 0
    lower, upper : float or None
        bounds [kg]; None leaves that side free
    """
    row = np.zeros(size)
    row[10 * link + _MASS] = 1.0
    return _interval(row, lower, upper, f"mass of {name or f'link {link + 1}'}")


def total_mass_inequalities(link_count: int, lower: float | None, upper: float | None, size: int) -> LinearInequalities:
    """The mass of all moving links together between two bounds: lo ≤ Σ m ≤ hi.

    Parameters
    ----------
    lower, upper : float or None
        bounds [kg]; None leaves that side free
    """
    row = np.zeros(size)
    row[_MASS : 10 * link_count : 10] = 1.0
    return _interval(row, lower, upper, "mass of all links")


def _interval(row: Array, lower: float | None, upper: float | None, label: str) -> LinearInequalities:
    """Rows of lo ≤ row · x ≤ hi."""
    matrix, bound, names = [], [], []
    if lower is not None:
        matrix.append(-row)
        bound.append(-lower)
        names.append(f"{label} ≥ {lower:g} kg")
    if upper is not None:
        matrix.append(row)
        bound.append(upper)
        names.append(f"{label} ≤ {upper:g} kg")
    return LinearInequalities(np.array(matrix).reshape(-1, row.size), np.array(bound, dtype=float), tuple(names))
