"""The chain between two links of a URDF: segments, limits, lumped inertias, friction.

Fixed joints are merged. A link's frame stays the frame of the URDF link that its joint carries, so a segment is
``origin · R | motion along z | Rᵀ`` where R carries z to the joint's axis. Bodies on fixed joints, also those beside
the chain, are added to the link that they move with; what moves beside the chain is left out of the model, with a
finding. Limits that exporters write for "not known" (zero, or beyond 1e9) count as not stated.
"""

from dataclasses import dataclass

import numpy as np

from tauscope.errors import RobotFileError
from tauscope.robot.document import MOST_JOINTS
from tauscope.robot.document_fields import LARGEST_NUMBER
from tauscope.robot.finding import Finding, Severity
from tauscope.robot.messages import nearest, one_line, shown
from tauscope.robot.placement import compose, rotation_of_z_to
from tauscope.robot.robot import FrictionCoefficients, JointLimits, JointType, LinkInertia, Placement, Repair, Segment
from tauscope.robot.urdf_element import Element, children, number, only_child, origin, urdf_error, vector, where
from tauscope.robot.urdf_inertia import lumped_inertia
from tauscope.robot.urdf_xml import UrdfJoint, UrdfTree, parse_urdf

MOVING = frozenset({"revolute", "continuous", "prismatic"})


@dataclass(frozen=True, eq=False)
class UrdfChain:
    """What a URDF says of the chain between two links, one entry a moving joint.

    links : tuple of LinkInertia, or None
        about the link frames; a link without any `<inertial>` is zero, None where no link has one
    friction : tuple of FrictionCoefficients, or None
        from `<dynamics>`; None where no joint has it
    """

    joint_names: tuple[str, ...]
    segments: tuple[Segment, ...]
    limits: tuple[JointLimits, ...]
    links: tuple[LinkInertia, ...] | None
    friction: tuple[FrictionCoefficients, ...] | None
    link_names: tuple[tuple[str, ...], ...]
    findings: tuple[Finding, ...]
    repairs: tuple[Repair, ...]


def read_urdf_chain(data: bytes, label: str, base: str, tip: str) -> UrdfChain:
    """The chain from link `base` to link `tip`.

    Raises
    ------
    RobotFileError
        if the URDF is not valid, or no chain of movable joints runs from base to tip
    """
    tree = parse_urdf(data, label)
    chain = _path(tree, base, tip)
    findings: list[Finding] = []
    moving = [joint for joint in chain if joint.type != "fixed"]
    for joint in moving:
        _check_movable(tree, joint)
    bodies = [_bodies(tree, joint, chain, findings) for joint in moving]
    lumped = [lumped_inertia(label, link, members, findings) for link, members in enumerate(bodies)]
    links = [link for link, _ in lumped]
    _remark_on_base(tree, base, findings)
    for joint, link in zip(moving, links, strict=True):
        if link is None and any(links):
            place = one_line(where(label, tree.links[joint.child]))
            findings.append(Finding(Severity.WARNING, place, "has no <inertial>; the model takes it as massless"))
    frictions = [_friction(tree, joint, findings) for joint in moving]
    return UrdfChain(
        joint_names=tuple(joint.name for joint in moving),
        segments=_segments(tree, chain, findings),
        limits=tuple(_limits(tree, joint, findings) for joint in moving),
        links=tuple(link or LinkInertia.from_vector(np.zeros(10)) for link in links) if any(links) else None,
        friction=tuple(f or FrictionCoefficients() for f in frictions) if any(frictions) else None,
        link_names=tuple(tuple(element.get("name") for element, _ in members) for members in bodies),
        findings=tuple(findings),
        repairs=tuple(repair for _, repairs in lumped for repair in repairs),
    )


def _path(tree: UrdfTree, base: str, tip: str) -> list[UrdfJoint]:
    """Joints from base to tip, base first."""
    for role, link in (("base", base), ("tip", tip)):
        if link not in tree.links:
            hint = nearest(link, tree.links)
            raise RobotFileError(one_line(f"{tree.label}: the {role} link {shown(link)} is not in the URDF; {hint}"))
    path: list[UrdfJoint] = []
    link = tip
    while link != base:
        joint = tree.parent_joint.get(link)
        if joint is None:
            text = (
                f"the tip {shown(tip)} hangs on {shown(link)}, not on the base {shown(base)}; name links of one chain"
            )
            raise RobotFileError(one_line(f"{tree.label}: {text}"))
        path.append(joint)
        link = joint.parent
    if not any(joint.type != "fixed" for joint in path):
        text = f"no moving joint lies between base {shown(base)} and tip {shown(tip)}; name the last link as tip"
        raise RobotFileError(one_line(f"{tree.label}: {text}"))
    if len(path) > MOST_JOINTS:
        raise RobotFileError(one_line(f"{tree.label}: the chain has {len(path)} joints, more than {MOST_JOINTS}"))
    return path[::-1]


def _remark_on_base(tree: UrdfTree, base: str, findings: list[Finding]) -> None:
    """Say so where the base itself could move."""
    link = base
    while (joint := tree.parent_joint.get(link)) is not None:
        if joint.type != "fixed":
            text = f"moves the base {shown(base)}; it is taken to stand still"
            findings.append(Finding(Severity.INFO, one_line(where(tree.label, joint.element)), text))
        link = joint.parent


def _check_movable(tree: UrdfTree, joint: UrdfJoint) -> None:
    """Refuse joints that are not one independent coordinate along or about an axis."""
    if joint.type not in MOVING:
        text = (
            f"type {joint.type} is not supported; the chain may hold revolute, continuous, prismatic and fixed joints"
        )
        raise urdf_error(tree.label, joint.element, text)
    if children(joint.element, "mimic"):
        text = "the joint mimics another; closed and coupled chains are not supported: choose a chain without it"
        raise urdf_error(tree.label, joint.element, text)


def _segments(tree: UrdfTree, chain: list[UrdfJoint], findings: list[Finding]) -> tuple[Segment, ...]:
    """Segments of the chain, fixed joints merged into the next moving one."""
    segments: list[Segment] = []
    pending = Placement()
    for joint in chain:
        pending = compose(pending, origin(tree.label, joint.element, findings))
        if joint.type == "fixed":
            continue
        align = Placement(rotation_of_z_to(_axis(tree, joint, findings)))
        kind = JointType.PRISMATIC if joint.type == "prismatic" else JointType.REVOLUTE
        segments.append(Segment(kind, compose(pending, align), Placement(align.rotation.T)))
        pending = Placement()
    return tuple(segments)


def _axis(tree: UrdfTree, joint: UrdfJoint, findings: list[Finding]) -> np.ndarray:
    """Unit vector of a joint's axis; x where none is given, as URDF defines."""
    element = only_child(tree.label, joint.element, "axis", findings)
    axis = vector(tree.label, element, "xyz", (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise urdf_error(tree.label, joint.element, "its axis is zero; give the direction, as xyz='0 0 1'")
    if abs(length - 1.0) > 1e-3:
        text = f"its axis has length {length:g}; its direction is used"
        findings.append(Finding(Severity.INFO, one_line(where(tree.label, joint.element)), text))
    return axis / length


def _bodies(
    tree: UrdfTree, joint: UrdfJoint, chain: list[UrdfJoint], findings: list[Finding]
) -> list[tuple[Element, Placement]]:
    """Link elements that move with a joint's child link, and where they sit in its frame."""
    bodies: list[tuple[Element, Placement]] = []
    waiting = [(joint.child, Placement())]
    while waiting:
        link, placement = waiting.pop()
        bodies.append((tree.links[link], placement))
        for below in tree.child_joints.get(link, ()):
            if below.type == "fixed":
                # The chain's own fixed joints are read again for the segments: remarks on them are made there.
                remarks = [] if below in chain else findings
                waiting.append((below.child, compose(placement, origin(tree.label, below.element, remarks))))
            elif below not in chain:
                text = (
                    f"moves beside the chain; link {shown(below.child)} and what hangs on it are left out of the model"
                )
                findings.append(Finding(Severity.WARNING, one_line(where(tree.label, below.element)), text))
    return bodies


def _limits(tree: UrdfTree, joint: UrdfJoint, findings: list[Finding]) -> JointLimits:
    """Limits of ``<limit>``; zero and endless values, which exporters write for "not known", count as not stated."""
    element = only_child(tree.label, joint.element, "limit", findings)
    if element is None:
        return JointLimits()
    lower, upper = (number(tree.label, element, key, 0.0) for key in ("lower", "upper"))
    if lower > upper and joint.type != "continuous":
        text = f"limits reversed: lower {lower:g} is above upper {upper:g}; swap them"
        raise urdf_error(tree.label, joint.element, text)
    stated = joint.type != "continuous" and lower < upper and max(-lower, upper) <= LARGEST_NUMBER
    return JointLimits(
        position=(lower, upper) if stated else None,
        velocity=_largest(tree, joint, element, "velocity"),
        torque=_largest(tree, joint, element, "effort"),
    )


def _largest(tree: UrdfTree, joint: UrdfJoint, element: Element, key: str) -> float | None:
    """The size of a velocity or an effort limit, None where it is not stated."""
    value = number(tree.label, element, key, 0.0)
    if value < 0.0:
        raise urdf_error(tree.label, joint.element, f"its {key} limit {value:g} is negative; give its size")
    return value if 0.0 < value <= LARGEST_NUMBER else None


def _friction(tree: UrdfTree, joint: UrdfJoint, findings: list[Finding]) -> FrictionCoefficients | None:
    """Friction of ``<dynamics>``: damping is viscous, friction is stiction without a Stribeck part."""
    element = only_child(tree.label, joint.element, "dynamics", findings)
    if element is None:
        return None
    damping, friction = (number(tree.label, element, key, 0.0) for key in ("damping", "friction"))
    if max(abs(damping), abs(friction)) > LARGEST_NUMBER:
        raise urdf_error(tree.label, joint.element, f"its <dynamics> is beyond {LARGEST_NUMBER:g}; check the unit (SI)")
    return FrictionCoefficients(stiction=friction, viscous=damping)
