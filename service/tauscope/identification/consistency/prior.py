"""What is plausible before any measurement: it decides only where the data do not."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from tauscope.identification.consistency.inequalities import FrictionColumns
from tauscope.identification.consistency.triangle import congruence, parameter_scale, triangle_of_parameters
from tauscope.robot import JointType, LinkInertia, Robot
from tauscope.robot.robot import Array

# Radius of gyration of a default link over its length: between a slender rod (0.29) and a compact housing.
_GYRATION = 0.25
# Radius of gyration, over the link's length, of the body that deviations are measured by, at least: a link's mass may
# lie anywhere along it and as far beside it.
_REACH = 1.0
# Speed that a joint is made for where its file does not say [rad/s or m/s].
_ORDINARY_SPEED = {JointType.REVOLUTE: 1.0, JointType.PRISMATIC: 0.3}
# Lengths of the whole arm beyond which no mass of it lies: a reflected rotor seems to reach a few, g mm² thousands.
_FAR = 100.0
_LIGHTEST = 0.1  # a link is believed to weigh at least this share of the heaviest
# Size of a link whose frames coincide in a chain that has no length at all, such as one joint by itself [m].
_SMALLEST_LENGTH = 0.05


@dataclass(frozen=True, eq=False)
class Prior:
    """A normal distribution of all parameters: ‖W (x - μ)‖² is χ² of as many degrees of freedom."""

    mean: Array  # (p,), μ: standard parameters of all links, then friction coefficients
    root: Array  # (p, p), W
    scale: Array  # (p,), expected magnitudes, positive; the conic program is scaled by them
    masses: Array  # (n,), mass that each link may be expected to have [kg]

    @property
    def link_count(self) -> int:
        """Number of links n."""
        return len(self.masses)

    def widen(self, width: float) -> "Prior":
        """The same bodies, believed so many times less. `width`: factor of the links' standard deviations."""
        links = np.arange(len(self.mean)) < 10 * self.link_count
        return replace(self, root=np.where(links[:, None], self.root / width, self.root))

    def squared_distance(self, parameters: Array) -> float:
        """‖W (x - μ)‖². `parameters`: (p,), x."""
        return float(np.sum((self.root @ (parameters - self.mean)) ** 2))


def plausible_prior(robot: Robot, factor: Array, target: Array, friction: FrictionColumns | None = None) -> Prior:
    """Bodies and friction that are plausible before any measurement.

    The links are those of the robot file's model where it has them and they can belong to the arm. Otherwise each link
    is a compact body half-way between its two joints, as large as their distance; without a model all have one common
    mass: the one that explains the data best. A link's deviation is measured by its own body: ‖A⁻¹ (J - J₀) A⁻ᵀ‖_F with
    A Aᵀ = J₀ the pseudo-inertia, made at least as thick as a compact body, so that it does not depend on units or on
    the frame (Lee & Park 2018, to second order). A link that no body can be was stated wrong by at least the distance d
    of the nearest body, measured so: its variance is 1 + d² times as large. Friction is expected to be absent; a
    coefficient's standard deviation is ‖z‖ / ‖R_i‖: that coefficient alone would explain all torque, and viscous
    friction would at the speed that the joint is made for. It is a tenth of that for τ_sc and the rotor's inertia, so
    that a motion that cannot tell τ_sc from τ_s (never slow enough) credits τ_s, and what cannot be told from the
    link's own inertia is credited to the link.

    `factor`: (r, p), R of the whitened least-squares problem ‖R x - z‖²; `target`: (r,), z.
    """
    count = robot.link_count
    lengths = link_lengths(robot)
    friction_scale = _friction_scale(factor[:, 10 * count :], target)
    if friction is not None:
        doubtful = (*friction.stribeck, *friction.rotor_inertia)
        friction_scale[[index - 10 * count for index in doubtful if index is not None]] *= 0.1
        for joint, stiction, viscous in zip(robot.joints, friction.stiction, friction.viscous, strict=True):
            if stiction is not None and viscous is not None:
                moving, step = (np.linalg.norm(factor[:, index]) for index in (viscous, stiction))
                made_for = joint.limits.velocity or _ORDINARY_SPEED[joint.type]
                if moving > 0.0 and step > 0.0:
                    friction_scale[viscous - 10 * count] *= min(moving / (step * made_for), 1.0)
    if robot.model.links is not None:
        links, masses = list(robot.model.links), _expected_masses(robot.model.links)
        for index in far_reaching(robot):
            unit = _default_link(robot, index, lengths[index])
            links[index] = LinkInertia.from_vector(masses[index] * unit.to_vector())
        lengths = np.maximum(lengths, [_extent(link) for link in links])
    else:
        unit_links = tuple(_default_link(robot, index, lengths[index]) for index in range(count))
        rotors = () if friction is None else tuple(index for index in friction.rotor_inertia if index is not None)
        mass = _common_mass(unit_links, np.delete(factor, rotors, axis=1), target)
        links = tuple(LinkInertia.from_vector(mass * link.to_vector()) for link in unit_links)
        masses = np.full(count, mass)
    mean = np.concatenate([*(link.to_vector() for link in links), np.zeros(friction_scale.size)])
    scale = np.concatenate([*map(parameter_scale, masses, lengths), friction_scale])
    root = np.diag(np.concatenate([np.zeros(10 * count), 1.0 / friction_scale]))
    for index, (link, mass, length) in enumerate(zip(links, masses, lengths, strict=True)):
        own = slice(10 * index, 10 * index + 10)
        deviation = _deviation(link, mass, length)
        root[own, own] = deviation / np.hypot(1.0, np.linalg.norm(deviation @ _measure_repair(robot, index)))
    return Prior(mean, root, scale, masses)


def far_reaching(robot: Robot) -> tuple[int, ...]:
    """Indices of links that cannot belong to the arm: their inertia is in another unit, and no prior."""
    links, whole = robot.model.links or (), float(link_lengths(robot).sum())
    reaches = (_extent(replace(link, mass=mass)) for link, mass in zip(links, _expected_masses(links), strict=True))
    return tuple(index for index, reach in enumerate(reaches) if reach > _FAR * whole)


def _expected_masses(links: Sequence[LinkInertia]) -> Array:
    """Mass that each link may be expected to have, (n,): its own, but not next to nothing; 1 kg where none has any."""
    heaviest = max((link.mass for link in links), default=0.0)
    return np.array([max(link.mass, _LIGHTEST * heaviest) or 1.0 for link in links])


def _measure_repair(robot: Robot, index: int) -> Array:
    """What repairs added to the stated parameters of a link, (10,); nothing where these are no prior."""
    if index in far_reaching(robot):
        return np.zeros(10)
    added = (each.after.to_vector() - each.before.to_vector() for each in robot.repairs if each.link == index)
    return sum(added, np.zeros(10))


def _deviation(link: LinkInertia, mass: float, length: float) -> Array:
    """W of one link, (10, 10): svec(A⁻¹ J A⁻ᵀ) by its parameters, A of a body of at least the link's own mass."""
    centre = link.first_moment / link.mass if link.mass > 0.0 else np.zeros(3)
    second_moment = np.zeros((3, 3))
    if link.mass > 0.0:
        about_origin = 0.5 * np.trace(link.inertia) * np.eye(3) - link.inertia
        second_moment = about_origin / link.mass - np.outer(centre, centre)
    values, axes = np.linalg.eigh(second_moment)
    thick = (axes * np.maximum(values, (_REACH * length) ** 2)) @ axes.T
    body = np.block([[thick + np.outer(centre, centre), centre[:, None]], [centre, 1.0]])
    inverse = solve_triangular(np.linalg.cholesky(mass * body), np.eye(4), lower=True)
    return congruence(inverse) @ triangle_of_parameters()


def link_lengths(robot: Robot) -> Array:
    """Size of each link, (n,) [m]: the distance of its two joints, and at least the chain's mean such distance."""
    spans = np.array([np.linalg.norm(np.subtract(*_joint_positions(robot, j))) for j in range(robot.link_count)])
    apart = spans[spans > 0.0]
    smallest = float(apart.mean()) if apart.size else 0.0
    return np.maximum(spans, max(smallest, _SMALLEST_LENGTH))


def _joint_positions(robot: Robot, index: int) -> tuple[Array, Array]:
    """Where a link's own joint and the next one are, in the link frame [m]; the last link ends at its frame."""
    after = robot.segments[index].after
    own = -after.rotation.T @ after.translation
    following = robot.segments[index + 1].before.translation if index + 1 < robot.link_count else np.zeros(3)
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
