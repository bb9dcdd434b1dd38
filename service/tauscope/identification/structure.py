"""Which columns the model has: base parameters of the rigid body, then every joint's friction and rotor.

τ_j = L_j Θ* + τ_s A(K_v q̇_j) + τ_sc A(δ q̇_j) + τ_v q̇_j + offset + I_a q̈_j,  A(x) = (2/π) atan x,
the paper's (14) and (7)–(9); an offset, because no current sensor is without one, and the rotor's reflected inertia
where the data ask for it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.dynamics.friction import smooth_sign
from tauscope.recording.recording import Array
from tauscope.robot import Robot


@dataclass(frozen=True)
class JointTerms:
    """Which terms one joint has beside the rigid body, and the shape constants of its friction."""

    k_v: float  # slope of the friction's step at zero velocity [s/rad or s/m]
    delta: float | None = None  # slope of the Stribeck term [s/rad or s/m]; None where the joint has no such term
    rotor: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joint's coefficients, in the order of their columns."""
        stribeck = () if self.delta is None else ("stribeck",)
        rotor = ("rotor_inertia",) if self.rotor else ()
        return ("stiction", *stribeck, "viscous", "offset", *rotor)


@dataclass(frozen=True, eq=False)
class ModelStructure:
    """The linear model's columns in their global order."""

    robot: Robot
    base: BaseParameters
    terms: tuple[JointTerms, ...]

    @property
    def base_count(self) -> int:
        """Number of base parameters m: the first columns."""
        return len(self.base.independent_columns)

    @property
    def size(self) -> int:
        """Number of all parameters p."""
        return self.base_count + sum(len(terms.names) for terms in self.terms)

    @property
    def names(self) -> tuple[str, ...]:
        """Readable names of all parameters: base expressions, then e.g. ``viscous joint2``."""
        joints = zip(self.terms, self.robot.joints, strict=True)
        return (*self.base.expressions, *(f"{name} {joint.name}" for terms, joint in joints for name in terms.names))

    def coefficient(self, joint: int, name: str) -> int | None:
        """Global column of a joint's coefficient, None where the model has no such term."""
        names = self.terms[joint].names
        if name not in names:
            return None
        return self.base_count + sum(len(terms.names) for terms in self.terms[:joint]) + names.index(name)

    def coefficients(self, name: str) -> dict[int, int]:
        """Global column of a coefficient by joint, of the joints that have it."""
        columns = ((joint, self.coefficient(joint, name)) for joint in range(self.robot.joint_count))
        return {joint: column for joint, column in columns if column is not None}

    def joint_columns(self, joint: int) -> NDArray[np.intp]:
        """Global columns, (p_j,), that can be non-zero in a joint's equation: links from it outwards, its own terms."""
        first = self.base_count + sum(len(terms.names) for terms in self.terms[:joint])
        own = np.arange(first, first + len(self.terms[joint].names))
        return np.concatenate([np.arange(self.base_count)[self.base.outward(joint)], own])

    def joint_term_columns(self, joint: int, velocity: Array, acceleration: Array) -> Array:
        """Columns (k, N) in the order of `JointTerms.names`; `velocity`, `acceleration`: (N,)."""
        terms = self.terms[joint]
        rows = {
            "stiction": lambda: smooth_sign(velocity, terms.k_v),
            "stribeck": lambda: smooth_sign(velocity, terms.delta or 0.0),
            "viscous": lambda: velocity,
            "offset": lambda: np.ones_like(velocity),
            "rotor_inertia": lambda: acceleration,
        }
        return np.stack([rows[name]() for name in terms.names])

    def with_terms(self, terms: tuple[JointTerms, ...]) -> "ModelStructure":
        """The same rigid body with other joint terms."""
        return replace(self, terms=terms)
