"""Torques and mass matrix of an arm whose standard parameters are given."""

from collections.abc import Iterator

import numpy as np

from tauscope.dynamics.chain_motion import Array, ChainMotion
from tauscope.dynamics.regressor import CHUNK
from tauscope.robot.robot import STANDARD_PARAMETERS, LinkInertia, Robot

# ε_ijk.
_LEVI_CIVITA = np.array([[[(i - j) * (j - k) * (k - i) / 2.0 for k in range(3)] for j in range(3)] for i in range(3)])


def inverse_dynamics(robot: Robot, parameters: Array, q: Array, qd: Array, qdd: Array) -> Array:
    """Joint torque τ = H(q) q̈ + h(q, q̇) + c(q) = Φ(q, q̇, q̈) Θ, (N, n) [Nm or N], equations (1) and (2).

    `parameters`: (10 m,), Θ, ten of each link as `STANDARD_PARAMETERS`; `q`, `qd`, `qdd`: (N, n) [SI].
    """
    joints, maps = robot.joint_count, [_wrench_of_motion(link) for link in _links(parameters)]
    motion = ChainMotion(robot, min(CHUNK, max(len(q), 1)))
    torque = np.zeros((joints, len(q)))
    for part in _chunks(len(q)):
        state = [np.ascontiguousarray(each[part].T) for each in (q, qd, qdd)]
        for wrench_of, moved in zip(maps, motion.links(*state), strict=True):
            wrench = wrench_of @ np.stack([*moved.acceleration, *(entry for row in moved.field for entry in row)])
            for screw, component in zip((*moved.screw_angular, *moved.screw_linear), wrench, strict=True):
                torque[: len(screw), part] += screw * component
    return np.ascontiguousarray(torque.T)


def gravity_torque(robot: Robot, parameters: Array, q: Array) -> Array:
    """Torque c(q) against gravity of (1), (N, n) [Nm or N]; `parameters`: (10 m,), Θ; `q`: (N, n) [rad or m]."""
    rest = np.zeros_like(q)
    return inverse_dynamics(robot, parameters, q, rest, rest)


def mass_matrix(robot: Robot, parameters: Array, q: Array) -> Array:
    """Joint-space inertia H(q) = Σ_j J_jᵀ G_j J_j of (1), (N, n, n); J_j: joint screws of link j, G_j: its inertia.

    `parameters`: (10 m,), Θ; `q`: (N, n) [rad or m]. Positive definite where links are possible [kg m², kg m, kg].
    """
    joints = robot.joint_count
    inertias = [_spatial_inertia(link) for link in _links(parameters)]
    motion = ChainMotion(robot, min(CHUNK, max(len(q), 1)))
    mass = np.zeros((len(q), joints, joints))
    for part in _chunks(len(q)):
        position = np.ascontiguousarray(q[part].T)
        rest = np.zeros_like(position)
        for inertia, moved in zip(inertias, motion.links(position, rest, rest), strict=True):
            screws = np.stack([*moved.screw_angular, *moved.screw_linear])
            met = screws.shape[1]
            momenta = np.tensordot(inertia, screws, axes=1)
            mass[part, :met, :met] += np.einsum("ain,akn->nik", screws, momenta)
    return mass


def _links(parameters: Array) -> list[LinkInertia]:
    return [LinkInertia.from_vector(vector) for vector in parameters.reshape(-1, len(STANDARD_PARAMETERS))]


def _spatial_inertia(link: LinkInertia) -> Array:
    """G, so that (n, f) = G (ω, v) are angular and linear momentum at the frame's origin."""
    x, y, z = link.first_moment
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.block([[link.inertia, cross], [-cross, link.mass * np.eye(3)]])


def _wrench_of_motion(link: LinkInertia) -> Array:
    """What makes moment n and force f at a link's origin of its motion, (n, f) = G (a, M), (6, 12).

    A point at r accelerates by a + M r. With m, ms and Σ = ∫ r rᵀ dm = ½ tr(I) 1 - I,
    f = m a + M ms and n = ∫ r × (a + M r) dm = ms × a + ε : (M Σ), n_i = ε_ijk (M Σ)_kj.
    """
    second = 0.5 * np.trace(link.inertia) * np.eye(3) - link.inertia
    x, y, z = link.first_moment
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    of_field = np.einsum("ijk,jl->ikl", _LEVI_CIVITA, second).reshape(3, 9)
    return np.block([[cross, of_field], [link.mass * np.eye(3), np.kron(np.eye(3), link.first_moment)]])


def _chunks(samples: int) -> Iterator[slice]:
    return (slice(start, min(start + CHUNK, samples)) for start in range(0, samples, CHUNK))
