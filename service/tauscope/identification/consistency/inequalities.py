"""Linear inequalities G x ≤ h on the full parameters: friction dissipates, masses and their centres are bounded."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.robot import STANDARD_PARAMETERS

Array = NDArray[np.float64]

_MASS = STANDARD_PARAMETERS.index("m")
_FIRST_MOMENT = STANDARD_PARAMETERS.index("msx")


@dataclass(frozen=True, eq=False)
class LinearInequalities:
    """Rows of G x ≤ h.

    matrix : (k, p) float64
        G
    bound : (k,) float64
        h
    """

    matrix: Array
    bound: Array
    names: tuple[str, ...]

    def __add__(self, other: "LinearInequalities") -> "LinearInequalities":
        """Both sets of rows together."""
        return LinearInequalities(
            np.vstack([self.matrix, other.matrix]),
            np.concatenate([self.bound, other.bound]),
            self.names + other.names,
        )

    @staticmethod
    def none(size: int) -> "LinearInequalities":
        """No row at all."""
        return LinearInequalities(np.empty((0, size)), np.empty(0), ())


@dataclass(frozen=True)
class FrictionColumns:
    """Index of each joint's friction coefficients in the parameter vector; None for an absent coefficient."""

    stiction: tuple[int | None, ...]
    stribeck: tuple[int | None, ...]
    viscous: tuple[int | None, ...]
    rotor_inertia: tuple[int | None, ...] = ()


def friction_inequalities(columns: FrictionColumns, size: int, joints: Sequence[str]) -> LinearInequalities:
    """Friction that only dissipates: τ_s ≥ 0, τ_s + τ_sc ≥ 0, τ_v ≥ 0 for every joint, and I_a ≥ 0 for every rotor.

    τ_sc, the difference of Coulomb friction and stiction, may be negative by itself, and an offset is free.
    """
    demands: list[tuple[str, list[int]]] = []
    rotors = columns.rotor_inertia or (None,) * len(joints)
    for name, stiction, stribeck, viscous, rotor in zip(
        joints, columns.stiction, columns.stribeck, columns.viscous, rotors, strict=True
    ):
        if stiction is not None:
            demands.append((f"stiction of {name} ≥ 0", [stiction]))
        if stribeck is not None:
            sliding = [stribeck] if stiction is None else [stiction, stribeck]
            demands.append((f"Coulomb friction of {name} ≥ 0", sliding))
        if viscous is not None:
            demands.append((f"viscous friction of {name} ≥ 0", [viscous]))
        if rotor is not None:
            demands.append((f"rotor inertia of {name} ≥ 0", [rotor]))
    matrix = np.zeros((len(demands), size))
    for row, (_, indices) in zip(matrix, demands, strict=True):
        row[indices] = -1.0
    return LinearInequalities(matrix, np.zeros(len(demands)), tuple(name for name, _ in demands))


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
