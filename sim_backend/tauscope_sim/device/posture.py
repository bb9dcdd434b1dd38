"""Where a simulated arm stands when nobody says where."""

import numpy as np
from numpy.typing import NDArray

from tauscope.robot.robot import Robot
from tauscope_sim.plant.rigid_bodies import RigidBodies

Array = NDArray[np.float64]

LEAST_SHARE = 1e-3
"""A joint whose inertia is below this share of what it has elsewhere stands in line with its links: steep friction on
next to no inertia is no place to begin at."""

POSTURES = 200
REACH = 1.0
"""Postures are looked for within so much of zero [rad or m]."""


def resting_posture(robot: Robot) -> Array:
    """Zero, or the end of each joint's range nearest to it; elsewhere where a joint has next to no inertia there.

    Returns
    -------
    (n,) float64
        position [rad or m]
    """
    ranges = np.array([joint.limits.position or (-np.inf, np.inf) for joint in robot.joints])
    nearest = np.clip(0.0, ranges[:, 0], ranges[:, 1])
    # the same arm stands at the same place every time
    near = np.random.default_rng(0).uniform(-REACH, REACH, (POSTURES, robot.joint_count))
    postures = np.vstack([nearest, np.clip(nearest + near, ranges[:, 0], ranges[:, 1])])
    bodies = RigidBodies(robot, np.zeros(robot.joint_count))
    inertia = np.array([_inertia(bodies, posture) for posture in postures])
    share = (inertia / inertia.max(axis=0)).min(axis=1)
    return nearest if share[0] >= LEAST_SHARE else postures[np.argmax(share)]


def _inertia(bodies: RigidBodies, posture: Array) -> Array:
    """Each joint's inertia with the others held, (n,)."""
    bodies.update(posture, np.zeros_like(posture))
    return bodies.mass_matrix().diagonal().copy()
