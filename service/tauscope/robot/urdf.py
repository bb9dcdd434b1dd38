"""The chain between two links of a URDF: segments, limits, lumped inertias, friction, and dependent joints.

A joint beside the chain is rigid at the value that ``locked`` states, else at 0, and the bodies that it carries count.
A mimic joint is at multiplier · master + offset (URDF's own definition), wherever its master is.

Fixed joints are merged. A link's frame stays the frame of the URDF link that its joint carries, so a segment is
``origin · R | motion along z | Rᵀ`` where R carries z to the joint's axis. Bodies beside the chain are added to the
link that they move with, those on moving joints where these joints rest (`tauscope.robot.urdf`). Limits that
exporters write for "not known" (zero, negative, reversed, or beyond 1e9) count as not stated.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from tauscope.errors import RobotFileError
from tauscope.result_warning import ResultWarning
from tauscope.robot.chain import Chain, ChainMotion, Master, default_ends_note, rigid_branch_note
from tauscope.robot.document import MOST_JOINTS
from tauscope.robot.document_fields import LARGEST_NUMBER
from tauscope.robot.kinematics import compose, joint_displacement, rotation_of_z_to
from tauscope.robot.messages import Finding, Severity, nearest, shown
from tauscope.robot.robot import FrictionCoefficients, JointLimits, JointType, LinkInertia, Placement, Segment
from tauscope.robot.urdf_element import Element, number, only_child, origin, urdf_error, vector, where
from tauscope.robot.urdf_xml import UrdfJoint, UrdfTree, lumped_inertia, parse_urdf, stated_mass

MOVING = frozenset({"revolute", "continuous", "prismatic"})


class JointMotions:
    """How the joints of a URDF move, some `locked` at a position by their names [rad or m]."""

    def __init__(self, tree: UrdfTree, locked: Mapping[str, float], path: Iterable[UrdfJoint]) -> None:
        self._tree, self._locked = tree, locked
        self._joints = {joint.name: joint for joint in tree.parent_joint.values()}
        for name in locked:
            if name not in self._joints:
                hint = nearest(name, self._joints)
                raise RobotFileError(f"{tree.label}: locked: joint {shown(name)} is not in the file; {hint}")
        free = [joint for joint in path if joint.type in MOVING and joint.name not in locked]
        self.chain = ChainMotion({joint.name: self.master(joint) for joint in free})
        self.independent = tuple(self._joints[name] for name in self.chain.independent)

    def master(self, joint: UrdfJoint) -> Master | None:
        """The joint that a mimic joint follows; None where it follows none."""
        multiplier, offset, met = 1.0, 0.0, [joint.name]
        while (mimic := only_child(self._tree.label, joint.element, "mimic", [])) is not None:
            name = mimic.get("joint") or ""
            if name not in self._joints:
                return None  # `remark_on_masters` warns
            if name in met:
                raise urdf_error(self._tree.label, joint.element, "mimics itself; name another joint in <mimic>")
            met.append(name)
            offset += multiplier * number(self._tree.label, mimic, "offset", 0.0)
            multiplier *= number(self._tree.label, mimic, "multiplier", 1.0)
            joint = self._joints[name]
            if joint.name in self._locked:
                break
        return None if len(met) == 1 else Master(joint.name, multiplier, offset)

    def remark_on_masters(self, findings: list[Finding]) -> None:
        """Say which mimic joints follow a joint that is not in the file; as in ROS, they move by themselves."""
        for joint in self._joints.values():
            mimic = only_child(self._tree.label, joint.element, "mimic", findings)
            if mimic is not None and (name := mimic.get("joint") or "") not in self._joints:
                text = f"mimics joint {shown(name)}, which is not in the file, and counts as free; "
                place = where(self._tree.label, joint.element)
                findings.append(Finding(Severity.WARNING, place, text + nearest(name, self._joints)))

    def is_locked(self, joint: UrdfJoint) -> bool:
        """Whether the robot file states where a joint stands, or where the one stands that it follows."""
        master = self.master(joint)
        return joint.name in self._locked or (master is not None and master.joint in self._locked)

    def follows_chain(self, joint: UrdfJoint) -> bool:
        """Whether a joint beside the chain follows one of the chain's."""
        master = None if joint.name in self._locked else self.master(joint)
        return bool(master and master.joint in self.chain.independent and master.multiplier)

    def rigid_motion(self, joint: UrdfJoint, findings: list[Finding]) -> Placement:
        """Displacement along or about a joint's axis that does not move with the chain: locked, following, or none."""
        if joint.type not in MOVING:
            return Placement()
        master = self.master(joint) or Master(joint.name, 0.0)
        position = self._locked.get(joint.name, master.multiplier * self._locked.get(master.joint, 0.0) + master.offset)
        if position == 0.0:
            return Placement()
        return joint_displacement(_joint_type(joint), joint_axis(self._tree, joint, findings), position)


def joint_axis(tree: UrdfTree, joint: UrdfJoint, findings: list[Finding]) -> np.ndarray:
    """Unit vector of a joint's axis, (3,); x where none is given, as URDF defines."""
    element = only_child(tree.label, joint.element, "axis", findings)
    axis = vector(tree.label, element, "xyz", (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise urdf_error(tree.label, joint.element, "its axis is zero; give the direction, as xyz='0 0 1'")
    if abs(length - 1.0) > 1e-3:
        text = f"its axis has length {length:g}; its direction is used"
        findings.append(Finding(Severity.INFO, where(tree.label, joint.element), text))
    return axis / length


@dataclass(frozen=True, eq=False)
class _Body:
    """A link element, where it sits in the frame of the link that it belongs to, and whether a joint carries it."""

    element: Element
    placement: Placement
    on_branch: bool


def read_urdf_chain(
    data: bytes, label: str, base: str | None = None, tip: str | None = None, locked: Mapping[str, float] | None = None
) -> Chain:
    """The chain from link `base` to `tip`, by default from the root to the deepest leaf. Raises RobotFileError."""
    findings: list[Finding] = []
    tree = parse_urdf(data, label, findings)
    is_default = base is None or tip is None
    base, tip = _ends(tree, base, tip, locked or {})
    path = _path(tree, base, tip)
    motions = JointMotions(tree, locked or {}, path)
    motions.remark_on_masters(findings)
    for joint in path:
        if joint.type not in MOVING and joint.type != "fixed" and joint.name not in (locked or {}):
            text = f"type {joint.type} is not supported in the chain; name the link beyond it as base"
            raise urdf_error(label, joint.element, text)
    if not motions.independent:
        text = f"no moving joint lies between base {shown(base)} and tip {shown(tip)}; name the last link as tip"
        raise RobotFileError(f"{label}: {text}")
    moving = [joint for joint in path if joint.name in motions.chain.moving]
    branches: list[UrdfJoint] = []
    bodies = [_bodies(tree, joint, path, motions, branches, findings) for joint in moving]
    lumped = [
        lumped_inertia(label, link, [(body.element, body.placement) for body in members], findings)
        for link, members in enumerate(bodies)
    ]
    links = [link for link, _ in lumped]
    _remark_on_base(tree, base, findings)
    for joint, link in zip(moving, links, strict=True):
        if link is None and any(links):
            place = where(label, tree.links[joint.child])
            findings.append(Finding(Severity.WARNING, place, "has no <inertial>; the model takes it as massless"))
    names = [joint.name for joint in motions.independent]
    for joint in moving:
        if (master := motions.master(joint)) is not None:
            text = f"follows {shown(master.joint)}: {master.multiplier:g} times its position, plus {master.offset:g}"
            findings.append(Finding(Severity.INFO, where(label, joint.element), text))
    notes = [default_ends_note(label, "urdf", base, tip, names)] if is_default else []
    return Chain(
        base=base,
        tip=tip,
        joint_names=tuple(names),
        joint_types=tuple(_joint_type(joint) for joint in motions.independent),
        segment_names=tuple(joint.name for joint in moving),
        segments=_segments(tree, path, motions, findings),
        limits=tuple(_limits(tree, joint, findings) for joint in motions.independent),
        links=tuple(link or LinkInertia.from_vector(np.zeros(10)) for link in links) if any(links) else None,
        friction=_friction(tree, moving, motions, findings),
        rotor_inertia=None,
        link_names=tuple(tuple(body.element.get("name") for body in members) for members in bodies),
        branches=tuple(_branch(label, members) for members in bodies),
        actuators=(None,) * len(names),
        findings=tuple(findings),
        repairs=tuple(repair for _, repairs in lumped for repair in repairs),
        notes=(*notes, *_branch_notes(tree, branches, motions)),
    )


def _ends(tree: UrdfTree, base: str | None, tip: str | None, locked: Mapping[str, float]) -> tuple[str, str]:
    """Base and tip: the root, or the first link below a joint that no arm has, and the leaf with most moving joints."""
    for role, link in (("base", base), ("tip", tip)):
        if link is not None and link not in tree.links:
            hint = nearest(link, tree.links)
            raise RobotFileError(f"{tree.label}: the {role} link {shown(link)} is not in the file; {hint}")
    if tip is None:
        leaves = [link for link in tree.links if link not in tree.child_joints]
        paths = {leaf: _up(tree, leaf, base) for leaf in leaves}
        reached = {leaf: path for leaf, path in paths.items() if path is not None}
        if not reached:
            text = "holds no links" if base is None else f"the base {shown(base)} carries no other link; name another"
            raise RobotFileError(f"{tree.label}: {text}")

        def depth(leaf: str) -> tuple[int, int]:
            moving = [joint for joint in reached[leaf] if joint.type in MOVING and joint.name not in locked]
            own = [joint for joint in moving if only_child(tree.label, joint.element, "mimic", []) is None]
            return len(own), len(reached[leaf])

        tip = max(reached, key=depth)
    if base is None:
        base = tip
        while (joint := tree.parent_joint.get(base)) is not None and joint.type in (*MOVING, "fixed"):
            base = joint.parent
    return base, tip


def _up(tree: UrdfTree, link: str, base: str | None) -> list[UrdfJoint] | None:
    """Joints from a link up to the base, or to the last that an arm can have; None where the base is not above it."""
    path: list[UrdfJoint] = []
    while link != base and (joint := tree.parent_joint.get(link)) is not None:
        if base is None and joint.type not in (*MOVING, "fixed"):
            break
        path.append(joint)
        link = joint.parent
    return path if base is None or (link == base and path) else None


def _path(tree: UrdfTree, base: str, tip: str) -> list[UrdfJoint]:
    path: list[UrdfJoint] = []
    link = tip
    while link != base:
        joint = tree.parent_joint.get(link)
        if joint is None:
            text = (
                f"the tip {shown(tip)} hangs on {shown(link)}, not on the base {shown(base)}; name links of one chain"
            )
            raise RobotFileError(f"{tree.label}: {text}")
        path.append(joint)
        link = joint.parent
    if len(path) > MOST_JOINTS:
        raise RobotFileError(f"{tree.label}: the chain has {len(path)} joints, more than {MOST_JOINTS}")
    return path[::-1]


def _remark_on_base(tree: UrdfTree, base: str, findings: list[Finding]) -> None:
    link = base
    while (joint := tree.parent_joint.get(link)) is not None:
        if joint.type != "fixed":
            text = f"moves the base {shown(base)}; it is taken to stand still"
            findings.append(Finding(Severity.INFO, where(tree.label, joint.element), text))
        link = joint.parent


def _joint_type(joint: UrdfJoint) -> JointType:
    return JointType.PRISMATIC if joint.type == "prismatic" else JointType.REVOLUTE


def _segments(
    tree: UrdfTree, path: list[UrdfJoint], motions: JointMotions, findings: list[Finding]
) -> tuple[Segment, ...]:
    """Segments of the chain, joints that do not move merged into the next moving one."""
    segments: list[Segment] = []
    pending = Placement()
    for joint in path:
        pending = compose(pending, origin(tree.label, joint.element, findings))
        if joint.name not in motions.chain.moving:
            pending = compose(pending, motions.rigid_motion(joint, findings))
            continue
        align = Placement(rotation_of_z_to(joint_axis(tree, joint, findings)))
        before, after = compose(pending, align), Placement(align.rotation.T)
        segments.append(Segment(_joint_type(joint), before, after, motions.chain.couplings[joint.name]))
        pending = Placement()
    return tuple(segments)


def _bodies(
    tree: UrdfTree,
    joint: UrdfJoint,
    path: list[UrdfJoint],
    motions: JointMotions,
    branches: list[UrdfJoint],
    findings: list[Finding],
) -> list[_Body]:
    bodies: list[_Body] = []
    waiting = [(joint.child, Placement(), False)]
    while waiting:
        link, placement, on_branch = waiting.pop()
        bodies.append(_Body(tree.links[link], placement, on_branch))
        for below in tree.child_joints.get(link, ()):
            if below.name in motions.chain.moving:
                continue
            # The chain's own joints are read again for the segments: remarks on them are made there.
            remarks = [] if below in path else findings
            rest = compose(origin(tree.label, below.element, remarks), motions.rigid_motion(below, remarks))
            waiting.append((below.child, compose(placement, rest), on_branch or below.type != "fixed"))
            if below.type != "fixed":
                branches.append(below)
    return bodies


def _branch(label: str, members: list[_Body]) -> LinkInertia:
    carried = [(body.element, body.placement) for body in members if body.on_branch]
    return lumped_inertia(label, 0, carried, [])[0] or LinkInertia.from_vector(np.zeros(10))


def _branch_notes(tree: UrdfTree, branches: list[UrdfJoint], motions: JointMotions) -> list[ResultWarning]:
    assumed = [joint for joint in branches if not motions.is_locked(joint)]
    mass = sum(stated_mass(tree, joint.child) for joint in _outermost(tree, assumed))
    if not mass > 0.0:
        return []
    following = [joint.name for joint in assumed if motions.follows_chain(joint)]
    return [rigid_branch_note(tree.label, [joint.name for joint in assumed], mass, following)]


def _outermost(tree: UrdfTree, joints: list[UrdfJoint]) -> list[UrdfJoint]:
    names = {joint.name for joint in joints}
    return [joint for joint in joints if not any(above.name in names for above in _up(tree, joint.parent, None) or ())]


def _limits(tree: UrdfTree, joint: UrdfJoint, findings: list[Finding]) -> JointLimits:
    """Limits of ``<limit>``; values that exporters write for "not known" count as not stated."""
    element = only_child(tree.label, joint.element, "limit", findings)
    if element is None:
        return JointLimits()
    lower, upper = (_limit(tree, element, key) for key in ("lower", "upper"))
    if lower > upper and joint.type != "continuous":
        text = f"limits reversed: lower {lower:g} is above upper {upper:g}; they count as not stated, correct them"
        findings.append(Finding(Severity.WARNING, where(tree.label, joint.element), text))
    stated = joint.type != "continuous" and lower < upper and max(-lower, upper) <= LARGEST_NUMBER
    return JointLimits(
        position=(lower, upper) if stated else None,
        velocity=_largest(tree, element, "velocity"),
        torque=_largest(tree, element, "effort"),
    )


def _largest(tree: UrdfTree, element: Element, key: str) -> float | None:
    value = _limit(tree, element, key)
    return value if 0.0 < value <= LARGEST_NUMBER else None


def _limit(tree: UrdfTree, element: Element, key: str) -> float:
    """A limit; endless where the file says so, zero where it says nothing."""
    text = (element.get(key) or "").strip().lower()
    if text.lstrip("+-") in ("inf", "infinity", ".inf"):
        return -math.inf if text.startswith("-") else math.inf
    return 0.0 if text.lstrip("+-") == "nan" else number(tree.label, element, key, 0.0)


def _friction(
    tree: UrdfTree, moving: list[UrdfJoint], motions: JointMotions, findings: list[Finding]
) -> tuple[FrictionCoefficients, ...] | None:
    """Friction of ``<dynamics>``, one a joint: damping is viscous, friction is stiction without a Stribeck part."""
    stated: dict[str, tuple[float, float]] = {}
    for joint in moving:
        element = only_child(tree.label, joint.element, "dynamics", findings)
        if element is None:
            continue
        dry, damping = (number(tree.label, element, key, 0.0) for key in ("friction", "damping"))
        if max(abs(damping), abs(dry)) > LARGEST_NUMBER:
            text = f"its <dynamics> is beyond {LARGEST_NUMBER:g}; check the unit (SI)"
            raise urdf_error(tree.label, joint.element, text)
        stated[joint.name] = (dry, damping)
    return motions.chain.friction(stated) if stated else None
