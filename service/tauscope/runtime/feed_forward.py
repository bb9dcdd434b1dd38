"""Torque that the robot file's model predicts for a motion, and the inertia along it."""

import numpy as np
from numpy.typing import NDArray

from tauscope.dynamics import friction_torque, inverse_dynamics, mass_matrix
from tauscope.robot import Robot

Array = NDArray[np.float64]

_MOST_POSTURES = 100_000


def predicted_torque(robot: Robot, position: Array, velocity: Array, acceleration: Array) -> Array | None:
    """Joint torque of the model, τ = H(q) q̈ + h(q, q̇) + c(q) + τ_f(q̇); None where the robot file has no model.

    Friction is left out where its coefficients or its shape are not stated.

    Parameters
    ----------
    position, velocity, acceleration : (N, n) float64
        the motion [rad or m, and per s, per s²]

    Returns
    -------
    (N, n) float64 or None
        [Nm or N]
    """
    parameters = _parameters(robot)
    if parameters is None:
        return None
    torque = inverse_dynamics(robot, parameters, position, velocity, acceleration)
    for j, coefficients in enumerate(robot.model.friction or ()):
        shape = robot.joints[j].friction_shape
        if shape.k_v is not None and shape.delta is not None:
            torque[:, j] += friction_torque(coefficients, shape, np.ascontiguousarray(velocity[:, j]))
    return torque


def inertia_along(robot: Robot, position: Array) -> tuple[Array, int] | None:
    """Joint-space inertia H along a motion; None where the robot file has no model.

    Parameters
    ----------
    position : (N, n) float64
        the motion [rad or m]

    Returns
    -------
    (K, n, n) float64 and int, or None
        H at every s-th posture, and s: so many that memory stays small [kg m², kg m, kg]
    """
    parameters = _parameters(robot)
    if parameters is None:
        return None
    stride = -(-len(position) // _MOST_POSTURES)
    return mass_matrix(robot, parameters, position[::stride]), stride


def _parameters(robot: Robot) -> Array | None:
    """Θ of the model's links."""
    if robot.model.links is None:
        return None
    return np.concatenate([link.to_vector() for link in robot.model.links])
