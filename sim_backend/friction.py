"""Static joint friction with stiction, Stribeck effect and viscous part, as physics to simulate."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from service.errors import RobotFileError
from service.robot.robot import FrictionCoefficients, FrictionShape

Array = NDArray[np.float64]


def static_friction_torque(
    velocity: Array, friction: Sequence[FrictionCoefficients], friction_shape: Sequence[FrictionShape]
) -> Array:
    """Friction torque τ_f = τ_s S₀(v) + τ_sc (2/π) arctan(v δ) + τ_v v, with S₀(v) = (2/π) arctan(v K_v).

    Parameters
    ----------
    velocity : (N, n) float64
        v = q̇ [rad/s or m/s]
    friction : sequence of FrictionCoefficients
        τ_s, τ_sc, τ_v, one entry a joint [Nm, Nm, Nm s/rad; N, N, N s/m]
    friction_shape : sequence of FrictionShape
        K_v and δ, one entry a joint [s/rad or s/m]; may be None where the coefficient that it shapes is zero

    Returns
    -------
    (N, n) float64
        τ_f, positive where the drive has to overcome it in the positive direction [Nm or N]

    Raises
    ------
    RobotFileError
        where a shape constant that is needed is None, or where the number of entries is not the number of joints

    Notes
    -----
    The paper's equations (7) and (8); its (7) prints the viscous part without v, its (9) has it.
    """
    joint_count = velocity.shape[1]
    if len(friction) != joint_count or len(friction_shape) != joint_count:
        raise RobotFileError(
            f"friction has {len(friction)} and friction_shape {len(friction_shape)} entries; "
            f"the arm has {joint_count} joints: give one entry a joint"
        )
    torque = np.empty_like(velocity)
    for column, (coefficients, shape) in enumerate(zip(friction, friction_shape, strict=True)):
        speed = velocity[:, column]
        stiction = _smooth_sign(speed, coefficients.stiction, shape.k_v, f"joint {column + 1}: friction_shape.k_v")
        stribeck = _smooth_sign(speed, coefficients.stribeck, shape.delta, f"joint {column + 1}: friction_shape.delta")
        torque[:, column] = stiction + stribeck + coefficients.viscous * speed
    return torque


def _smooth_sign(speed: Array, level: float, slope: float | None, place: str) -> Array:
    """Level times a sign function that the arctangent makes continuous, shape (N,)."""
    if level == 0.0:
        return np.zeros_like(speed)
    if slope is None:
        raise RobotFileError(f"{place} is missing; a simulation with friction needs it [s/rad or s/m]")
    return level * np.arctan(slope * speed) / (0.5 * math.pi)
