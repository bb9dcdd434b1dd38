"""Torque that a motion takes, by MuJoCo's inverse dynamics."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def rigid_body_torque(model: mujoco.MjModel, position: Array, velocity: Array, acceleration: Array) -> Array:
    """Joint torque τ = H(q) q̈ + h(q, q̇) + c(q) along a motion, by ``mj_inverse``.

    Parameters
    ----------
    position : (N, n) float64
        q [rad or m]
    velocity : (N, n) float64
        q̇ [rad/s or m/s]
    acceleration : (N, n) float64
        q̈ [rad/s² or m/s²]

    Returns
    -------
    (N, n) float64
        τ without friction, the paper's equation (1) [Nm or N]
    """
    data = mujoco.MjData(model)
    torque = np.empty_like(position)
    for row in range(len(position)):
        data.qpos[:] = position[row]
        data.qvel[:] = velocity[row]
        data.qacc[:] = acceleration[row]
        mujoco.mj_inverse(model, data)
        torque[row] = data.qfrc_inverse
    return torque
