"""Linear inequalities G x ≤ h on the full parameters: friction dissipates, and no link weighs next to nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.robot import STANDARD_PARAMETERS
from tauscope.robot.robot import Array

# Share of the stiction that Coulomb friction is at least: dry friction falls by half with speed, hardly by more.
LEAST_COULOMB = 1 / 3


@dataclass(frozen=True, eq=False)
class LinearInequalities:
    """Rows of G x ≤ h. `matrix`: (k, p), G; `bound`: (k,), h."""

    matrix: Array
    bound: Array
    names: tuple[str, ...]

    def __add__(self, other: "LinearInequalities") -> "LinearInequalities":
        """Both sets of rows together."""
        return LinearInequalities(
            np.vstack([self.matrix, other.matrix]), np.concatenate([self.bound, other.bound]), self.names + other.names
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
    """Dissipative friction: τ_s, τ_v, I_a ≥ 0 and τ_s + τ_sc ≥ c τ_s, c = `LEAST_COULOMB`; an offset is free."""
    demands: list[tuple[str, dict[int, float]]] = []
    rotors = columns.rotor_inertia or (None,) * len(joints)
    for name, stiction, stribeck, viscous, rotor in zip(
        joints, columns.stiction, columns.stribeck, columns.viscous, rotors, strict=True
    ):
        if stiction is not None:
            demands.append((f"stiction of {name} ≥ 0", {stiction: 1.0}))
        if stribeck is not None:
            sliding = {stribeck: 1.0} if stiction is None else {stiction: 1.0 - LEAST_COULOMB, stribeck: 1.0}
            demands.append((f"Coulomb friction of {name} ≥ {LEAST_COULOMB} of its stiction", sliding))
        if viscous is not None:
            demands.append((f"viscous friction of {name} ≥ 0", {viscous: 1.0}))
        if rotor is not None:
            demands.append((f"rotor inertia of {name} ≥ 0", {rotor: 1.0}))
    matrix = np.zeros((len(demands), size))
    for row, (_, factors) in zip(matrix, demands, strict=True):
        row[list(factors)] = [-factor for factor in factors.values()]
    return LinearInequalities(matrix, np.zeros(len(demands)), tuple(name for name, _ in demands))


def mass_inequalities(least: Array, size: int) -> LinearInequalities:
    """No link weighs less than this. `least`: (n,), smallest mass of every link [kg]."""
    matrix = np.zeros((len(least), size))
    matrix[np.arange(len(least)), 10 * np.arange(len(least)) + STANDARD_PARAMETERS.index("m")] = -1.0
    names = tuple(f"mass of link {link + 1} ≥ {mass:.3g} kg" for link, mass in enumerate(least))
    return LinearInequalities(matrix, -least, names)
