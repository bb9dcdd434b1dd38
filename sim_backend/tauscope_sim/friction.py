"""Static joint friction with stiction, Stribeck effect and viscous part, as physics to simulate."""

import math
from collections.abc import Sequence

import numpy as np

from tauscope.errors import RobotFileError
from tauscope.robot.robot import Array, FrictionCoefficients, FrictionShape


def static_friction_torque(
    velocity: Array, friction: Sequence[FrictionCoefficients], friction_shape: Sequence[FrictionShape]
) -> Array:
    """Friction torque τ_f = τ_s S₀(v) + τ_sc (2/π) arctan(v δ) + τ_v v, with S₀(v) = (2/π) arctan(v K_v).

    Positive where the drive has to overcome it, (N, n) [Nm or N]; `velocity`: (N, n), v = q̇. The paper's (7) and (8);
    its (7) prints the viscous part without v. `friction_shape`: K_v and δ of each joint [s/rad or s/m], None where not
    needed. Raises RobotFileError where one that is needed is None.
    """
    joint_count = velocity.shape[1]
    if len(friction) != joint_count or len(friction_shape) != joint_count:
        raise RobotFileError(
            f"friction has {len(friction)} and friction_shape {len(friction_shape)} entries; "
            f"the arm has {joint_count} joints: give one entry a joint"
        )
    k_v, delta = np.array(shape_constants(friction, friction_shape)).T
    stiction, stribeck, viscous = np.array([(one.stiction, one.stribeck, one.viscous) for one in friction]).T
    coulomb = stiction * np.arctan(k_v * velocity) / (0.5 * math.pi)
    return coulomb + stribeck * np.arctan(delta * velocity) / (0.5 * math.pi) + viscous * velocity


def shape_constants(
    friction: Sequence[FrictionCoefficients], friction_shape: Sequence[FrictionShape]
) -> list[tuple[float, float]]:
    """K_v and δ of each joint; zero where not needed. Raises RobotFileError where a needed one is None."""
    constants: list[tuple[float, float]] = []
    for number, (coefficients, shape) in enumerate(zip(friction, friction_shape, strict=True), 1):
        place = f"joint {number}: friction_shape"
        k_v = _require(shape.k_v, coefficients.stiction, f"{place}.k_v")
        constants.append((k_v, _require(shape.delta, coefficients.stribeck, f"{place}.delta")))
    return constants


def _require(slope: float | None, level: float, place: str) -> float:
    if slope is None and level != 0.0:
        raise RobotFileError(f"{place} is missing; a simulation with friction needs it [s/rad or s/m]")
    return 0.0 if slope is None else slope


def smooth_sign(velocity: float, k_v: float) -> float:
    """A(v) = (2/π) arctan(K_v v), a continuous sgn v, equation (8). v [rad/s or m/s]; K_v [s/rad or s/m]."""
    return math.atan(k_v * velocity) / (0.5 * math.pi)


def smooth_sign_slope(velocity: float, k_v: float) -> float:
    """dA/dv = (2/π) K_v / (1 + (K_v v)²) [s/rad or s/m]. `velocity`: v [rad/s or m/s]; `k_v`: K_v [s/rad or s/m]."""
    scaled = k_v * velocity
    return k_v / (1.0 + scaled * scaled) / (0.5 * math.pi)
