"""What is plausible before any measurement: it decides only where the data do not."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.identification.consistency.inequalities import FrictionColumns
from tauscope.identification.consistency.triangle import parameter_scale
from tauscope.robot import LinkInertia, Robot

Array = NDArray[np.float64]

_GYRATION = 0.25
"""Radius of gyration of a default link over its length: between a slender rod (0.29) and a compact housing."""

_SMALLEST_LENGTH = 0.05
"""Size of a link whose frames coincide in a chain that has no length at all, such as one joint by itself [m]."""


@dataclass(frozen=True, eq=False)
class Prior:
    """A plausible parameter vector and the magnitude that each parameter may be expected to have.

    mean : (p,) float64
        standard parameters of all links, then friction coefficients
    scale : (p,) float64
        expected magnitudes, positive; the program is scaled by them
    link_scale : (n, 2) float64
        mass [kg] and length [m] behind the scale of each link
    """

    mean: Array
    scale: Array
    link_scale: Array


def plausible_prior(robot: Robot, factor: Array, target: Array, friction: FrictionColumns | None = None) -> Prior:
    """A plausible point for the directions that torque data leave open.

    The links are those of the robot file's model where it has them. Otherwise each link is a compact body half-way
    between its two joints, as large as their distance, and all have one common mass: the one that explains the data
    best. Friction is expected to be absent. A coefficient's magnitude is ‖z‖ / ‖R_i‖: that coefficient alone would
    explain all torque. It is a tenth of that for τ_sc and the rotor's inertia, so that a motion that cannot tell τ_sc
    from τ_s (never slow enough) credits τ_s, and what cannot be told from the link's own inertia is credited to the
    link.

    Parameters
    ----------
    factor : (r, p) float64
        R of the whitened least-squares problem ‖R x - z‖²
    target : (r,) float64
        z
    """
    lengths = link_lengths(robot)
    friction_scale = _friction_scale(factor[:, 10 * robot.joint_count :], target)
    if friction is not None:
        doubtful = (*friction.stribeck, *friction.rotor_inertia)
        friction_scale[[index - 10 * robot.joint_count for index in doubtful if index is not None]] *= 0.1
    if robot.model.links is not None:
        links = robot.model.links
        heaviest = max(link.mass for link in links)
        masses = np.array([max(link.mass, 0.1 * heaviest) for link in links])
        lengths = np.maximum(lengths, [_extent(link) for link in links])
    else:
        unit_links = tuple(_default_link(robot, index, lengths[index]) for index in range(robot.joint_count))
        rotors = () if friction is None else tuple(index for index in friction.rotor_inertia if index is not None)
        mass = _common_mass(unit_links, np.delete(factor, rotors, axis=1), target)
        links = tuple(LinkInertia.from_vector(mass * link.to_vector()) for link in unit_links)
        masses = np.full(robot.joint_count, mass)
    if not np.all(masses > 0.0):
        masses = np.ones(robot.joint_count)
    mean = np.concatenate([*(link.to_vector() for link in links), np.zeros(friction_scale.size)])
    scale = np.concatenate([*map(parameter_scale, masses, lengths), friction_scale])
    return Prior(mean, scale, np.column_stack([masses, lengths]))


def link_lengths(robot: Robot) -> Array:
    """Size of each link: the distance of its two joints, at least a quarter of the chain's mean such distance.

    Returns
    -------
    (n,) float64
        lengths [m], positive
    """
    spans = np.array([np.linalg.norm(np.subtract(*_joint_positions(robot, j))) for j in range(robot.joint_count)])
    apart = spans[spans > 0.0]
    smallest = 0.25 * float(apart.mean()) if apart.size else 0.0
    return np.maximum(spans, max(smallest, _SMALLEST_LENGTH))


def _joint_positions(robot: Robot, index: int) -> tuple[Array, Array]:
    """Where a link's own joint and the next one are, in the link frame [m]; the last link ends at its frame."""
    after = robot.segments[index].after
    own = -after.rotation.T @ after.translation
    following = robot.segments[index + 1].before.translation if index + 1 < robot.joint_count else np.zeros(3)
    return own, following


def _default_link(robot: Robot, index: int, length: float) -> LinkInertia:
    """A compact body of 1 kg half-way between a link's joints."""
    own, following = _joint_positions(robot, index)
    centre = 0.5 * (own + following)
    second_moment = (_GYRATION * length) ** 2 * np.eye(3) + np.outer(centre, centre)
    return LinkInertia(1.0, centre, np.trace(second_moment) * np.eye(3) - second_moment)


def _common_mass(unit_links: tuple[LinkInertia, ...], factor: Array, target: Array) -> float:
    """The one mass of all default links that explains the data best, without rotors, friction free; 10 g to 1 t."""
    inertial = np.concatenate([link.to_vector() for link in unit_links])
    columns = np.column_stack([factor[:, : inertial.size] @ inertial, factor[:, inertial.size :]])
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0.0] = 1.0
    mass = np.linalg.lstsq(columns / norms, target, rcond=1e-10)[0][0] / norms[0]
    return float(np.clip(abs(mass), 0.01, 1000.0)) if np.any(columns[:, 0]) else 1.0


def _extent(link: LinkInertia) -> float:
    """Root of the largest second moment over the mass: how far a link's mass reaches from its frame's origin [m]."""
    if link.mass <= 0.0:
        return 0.0
    second_moment = 0.5 * np.trace(link.inertia) * np.eye(3) - link.inertia
    return float(np.sqrt(max(np.linalg.eigvalsh(second_moment)[-1], 0.0) / link.mass))


def _friction_scale(columns: Array, target: Array) -> Array:
    """Magnitude with which each coefficient alone would explain all torque; 1 for a column without information."""
    norms = np.linalg.norm(columns, axis=0)
    reach = float(np.linalg.norm(target))
    silent = (norms == 0.0) | (reach == 0.0)
    return np.where(silent, 1.0, reach / np.where(silent, 1.0, norms))
