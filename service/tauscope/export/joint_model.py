"""What an export says of one joint and the link that it carries, in the terms that simulators have.

Simulators know two friction numbers: a dry level and a damping. The dry level is the kinetic Coulomb level τ_s + τ_sc,
what is left at speed: it is felt over most of any motion, while τ_s is felt only near rest. The damping is τ_v.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import ExportError
from tauscope.export.compensation.model import JointFriction, check_friction
from tauscope.robot import LinkInertia, Robot, find_defect, nearest_body
from tauscope.robot.messages import shown


@dataclass(frozen=True, eq=False)
class JointModel:
    """One joint's part of the model; None leaves what the file says as it is."""

    link: LinkInertia | None = None
    friction: JointFriction | None = None
    rotor_inertia: float | None = None  # the motor's inertia reflected to the joint [kg m² or kg]
    branch: LinkInertia | None = None  # the part of the link that the file has on moving joints beside the chain


@dataclass(frozen=True, eq=False)
class CentredInertia:
    """A link as simulators want it."""

    mass: float  # m [kg]
    centre: NDArray[np.float64]  # (3,), centre of mass in the link frame [m]
    inertia: NDArray[np.float64]  # (3, 3), about the centre of mass, along the axes of the link frame [kg m²]

    @property
    def full(self) -> NDArray[np.float64]:
        """The six entries of the inertia as an MJCF lists them: xx, yy, zz, xy, xz, yz [kg m²]."""
        return LinkInertia(self.mass, self.mass * self.centre, self.inertia).to_vector()[:6]


def numbers(*values: float | np.float64) -> str:
    """Numbers that read back as the same float64; no negative zero."""
    return " ".join(repr(float(value) + 0.0) for value in values)


def joint_models(
    robot: Robot,
    links: Sequence[LinkInertia],
    friction: Sequence[JointFriction],
    rotor_inertia: Sequence[float | None] | None = None,
) -> dict[str, JointModel]:
    """Models by the labels of segments; `links` by segment, `friction` by joint."""
    rotors = [None] * robot.joint_count if rotor_inertia is None else rotor_inertia
    own = {link: joint for joint, link in enumerate(robot.own_links)}
    made: dict[str, JointModel] = {}
    for index, (label, link) in enumerate(zip(robot.segment_labels, links, strict=True)):
        branch = robot.branches[index] if robot.branches else None
        joint = own.get(index)
        mine = (None, None) if joint is None else (friction[joint], rotors[joint])
        made[label] = JointModel(link, *mine, branch)
    return made


def centred(joint: str, link: LinkInertia) -> CentredInertia:
    """Centre of mass and I_c = I - m (sᵀs 1 - s sᵀ), (5) reversed. Raises ExportError for no rigid body."""
    finite = bool(np.isfinite(link.to_vector()).all())
    defect = find_defect(link) if finite and link.mass > 0.0 else f"mass {link.mass:g} kg"
    if defect is not None:
        text = f"the link of joint {shown(joint)} cannot exist ({defect}); export the physically consistent model"
        raise ExportError(text)
    centre = link.first_moment / link.mass
    inertia = link.inertia - link.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return CentredInertia(link.mass, centre, 0.5 * (inertia + inertia.T))


def dry_friction_and_damping(joint: str, friction: JointFriction) -> tuple[float, float]:
    """τ_s + τ_sc and τ_v, neither below zero, as simulators hold them. Raises ExportError if not finite."""
    check_friction(joint, friction)
    return max(0.0, friction.stiction + friction.stribeck), max(0.0, friction.viscous)


def friction_notes(joint: str, friction: JointFriction, format_name: str) -> list[str]:
    """What is lost of a joint's friction in a format that holds a dry level and a damping."""
    notes = []
    if friction.stribeck != 0.0:
        notes.append(
            f"{joint}: {format_name} has no Stribeck effect. Written is the level at speed, stiction + stribeck = "
            f"{friction.stiction + friction.stribeck:.6g}; near rest the identified friction is {friction.stiction:.6g}"
            f" (delta = {friction.delta:.6g})."
        )
    if friction.offset != 0.0:
        notes.append(f"{joint}: {format_name} has no constant torque; the identified offset is {friction.offset:.6g}.")
    if friction.stiction + friction.stribeck != 0.0:
        notes.append(
            f"{joint}: {format_name} takes dry friction as a step at zero velocity; identified is "
            f"(2/pi) atan(k_v v) with k_v = {friction.k_v:.6g}."
        )
    for label, value in (("stiction + stribeck", friction.stiction + friction.stribeck), ("viscous", friction.viscous)):
        if value < 0.0:
            notes.append(f"{joint}: the identified {label} = {value:.6g} would drive the joint; 0 is written.")
    return notes


def without_branch(name: str, model: JointModel) -> tuple[LinkInertia, list[str]]:
    """A link without the bodies that the file has elsewhere; and notes. Raises ExportError if they weigh more."""
    link = model.link or LinkInertia.from_vector(np.zeros(10))
    if model.branch is None or not np.any(model.branch.to_vector()):
        return link, []
    own = LinkInertia.from_vector(link.to_vector() - model.branch.to_vector())
    if own.mass > 0.0 and find_defect(own) is None:
        return own, []
    text = f"{name}: the identified link less the bodies beside the chain is no body; the nearest body is written."
    body = nearest_body(own)
    if not body.mass > 0.0:
        raise ExportError(
            f"joint {shown(name)}: the bodies beside the chain weigh more than its link; export .xml instead"
        )
    return body, [text]
