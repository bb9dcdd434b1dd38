"""URDF text to links and joints: checked names, and a tree without loops."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from tauscope.robot.document_fields import LONGEST_NAME
from tauscope.robot.kinematics import compose
from tauscope.robot.messages import Finding, Severity, nearest, shown
from tauscope.robot.physical import nearest_body, repair_text
from tauscope.robot.robot import LinkInertia, Placement, Repair
from tauscope.robot.urdf_element import (
    EXPAND,
    Element,
    bounded_number,
    children,
    local_name,
    number,
    only_child,
    origin,
    urdf_error,
    where,
)
from tauscope.robot.xml_text import parse_xml

JOINT_TYPES = frozenset({"revolute", "continuous", "prismatic", "fixed", "floating", "planar"})
XACRO_DEFINITIONS = frozenset({"arg", "macro", "property"})  # elements of xacro that stand for no link or joint


@dataclass(frozen=True)
class UrdfJoint:
    """A joint of a URDF."""

    name: str
    type: str
    parent: str
    child: str
    element: Element


@dataclass(frozen=True)
class UrdfTree:
    """Links and joints of a URDF."""

    label: str
    links: Mapping[str, Element]
    parent_joint: Mapping[str, UrdfJoint]
    child_joints: Mapping[str, tuple[UrdfJoint, ...]]


def parse_urdf(data: bytes, label: str, findings: list[Finding]) -> UrdfTree:
    """Links and joints of URDF text. Raises RobotFileError for a DOCTYPE, text that is no XML, or no forest."""
    root = parse_xml(data, label, findings)
    _refuse_xacro(root, label, findings)
    if local_name(root) != "robot":
        raise urdf_error(label, root, "a URDF's root element is <robot>; is it the right file?")
    links: dict[str, Element] = {}
    for element in children(root, "link"):
        name = _name(label, element)
        if name in links:
            raise urdf_error(
                label, element, f"the link stands twice, first on line {links[name].sourceline}; rename one"
            )
        links[name] = element
    return _connect(label, links, [_joint(label, element, links) for element in children(root, "joint")])


def _refuse_xacro(root: Element, label: str, findings: list[Finding]) -> None:
    """Refuse what xacro would replace by links and joints; definitions that it left over change nothing."""
    for element in root:
        if not isinstance(element.tag, str) or not _is_xacro(element):
            continue
        name = local_name(element).rpartition(":")[2]
        if name not in XACRO_DEFINITIONS:
            raise urdf_error(label, element, f"the file is a xacro; {EXPAND}")
        text = "is left over from xacro; it is ignored, as ROS' own parser does"
        findings.append(Finding(Severity.INFO, where(label, element), text))


def _is_xacro(element: Element) -> bool:
    """Whether an element belongs to xacro, by its namespace or by a prefix that is not declared."""
    namespace, _, name = element.tag.rpartition("}")
    return namespace.rstrip("/").endswith("/xacro") or name.startswith("xacro:")


def _joint(label: str, element: Element, links: Mapping[str, Element]) -> UrdfJoint:
    name = _name(label, element)
    kind = element.get("type")
    if kind not in JOINT_TYPES:
        hint = nearest(kind or "", JOINT_TYPES)
        raise urdf_error(label, element, f"type {shown(kind)} is not a joint type; {hint}")
    ends: list[str] = []
    for end in ("parent", "child"):
        nodes = children(element, end)
        link = nodes[0].get("link") if len(nodes) == 1 else None
        if link is None:
            raise urdf_error(label, element, f"must hold one <{end} link=…> element")
        if link not in links:
            raise urdf_error(label, element, f"its {end} link {shown(link)} is not in the file; {nearest(link, links)}")
        ends.append(link)
    return UrdfJoint(name, kind, ends[0], ends[1], element)


def _connect(label: str, links: Mapping[str, Element], joints: list[UrdfJoint]) -> UrdfTree:
    """Links and joints with the two look-ups; a link hangs on one joint at most."""
    names: dict[str, UrdfJoint] = {}
    parent_joint: dict[str, UrdfJoint] = {}
    child_joints: dict[str, list[UrdfJoint]] = {}
    for joint in joints:
        if joint.name in names:
            first = names[joint.name].element.sourceline
            raise urdf_error(label, joint.element, f"the joint stands twice, first on line {first}; rename one")
        if joint.child in parent_joint:
            other = parent_joint[joint.child].name
            raise urdf_error(
                label,
                joint.element,
                f"its child link {shown(joint.child)} already hangs on joint {shown(other)}; remove one",
            )
        names[joint.name] = parent_joint[joint.child] = joint
        child_joints.setdefault(joint.parent, []).append(joint)
    tree = UrdfTree(label, links, parent_joint, {link: tuple(below) for link, below in child_joints.items()})
    _refuse_loops(tree)
    return tree


def _refuse_loops(tree: UrdfTree) -> None:
    """Every link must hang, through its joints, on a link that hangs on none."""
    waiting = [link for link in tree.links if link not in tree.parent_joint]
    hanging = set(waiting)
    while waiting:
        below = [joint.child for joint in tree.child_joints.get(waiting.pop(), ())]
        hanging.update(below)
        waiting.extend(below)
    for link, joint in tree.parent_joint.items():
        if link not in hanging:
            raise urdf_error(tree.label, joint.element, "the joints form a loop; a URDF is a tree, remove one of them")


def _name(label: str, element: Element) -> str:
    name = element.get("name")
    if not name or not name.strip() or len(name) > LONGEST_NAME or not name.isprintable():
        raise urdf_error(label, element, f"needs a printable name of at most {LONGEST_NAME} characters")
    return name


ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def inertia_about_frame(mass: float, centre: Placement, inertia: np.ndarray) -> LinkInertia:
    """Parameters about a link frame, (5): I' = R I Rᵀ + m (sᵀs 1 - s sᵀ); `inertia`: (3, 3) [kg m²]."""
    s, rotation = centre.translation, centre.rotation
    shifted = rotation @ inertia @ rotation.T + mass * (s @ s * np.eye(3) - np.outer(s, s))
    return LinkInertia(mass, mass * s, 0.5 * (shifted + shifted.T))


def lumped_inertia(
    label: str, link: int, bodies: Iterable[tuple[Element, Placement]], findings: list[Finding]
) -> tuple[LinkInertia | None, list[Repair]]:
    """Sum of placed inertials that move with link `link`, None where it has none. Raises RobotFileError."""
    vectors, repairs = [], []
    for body, placement in bodies:
        element = only_child(label, body, "inertial", findings)
        if element is None:
            continue
        stated = _read_inertia(label, body, element, findings)
        centre = compose(placement, origin(label, element, findings))
        used = nearest_body(stated)
        before, after = (inertia_about_frame(each.mass, centre, each.inertia) for each in (stated, used))
        place = f"{where(label, element)} of link {shown(body.get('name'))}"
        if text := repair_text(stated, used):
            repairs.append(Repair(link, place, text, "correct the <inertial>", before, after))
        else:
            _remark(place, stated, findings)
        vectors.append(after.to_vector())
    return LinkInertia.from_vector(np.sum(vectors, axis=0)) if vectors else None, repairs


def stated_mass(tree: UrdfTree, link: str) -> float:
    """Mass of a link and of everything that hangs on it [kg], as the file states it."""
    total, waiting = 0.0, [link]
    while waiting:
        name = waiting.pop()
        element = only_child(tree.label, tree.links[name], "inertial", [])
        mass = None if element is None else only_child(tree.label, element, "mass", [])
        total += 0.0 if mass is None else number(tree.label, mass, "value", 0.0)
        waiting += [joint.child for joint in tree.child_joints.get(name, ())]
    return total


def _read_inertia(label: str, body: Element, element: Element, findings: list[Finding]) -> LinkInertia:
    """An `<inertial>` as it stands, about the centre of mass."""
    parts = {kind: only_child(label, element, kind, findings) for kind in ("mass", "inertia")}
    place = f"{where(label, element)} of link {shown(body.get('name'))}"
    for kind, part in parts.items():
        if part is None:
            findings.append(Finding(Severity.WARNING, place, f"has no <{kind}>, which counts as zero; add it"))
    mass = 0.0 if parts["mass"] is None else bounded_number(label, parts["mass"], "value")
    if parts["inertia"] is None:
        return LinkInertia(mass, np.zeros(3), np.zeros((3, 3)))
    xx, xy, xz, yy, yz, zz = (bounded_number(label, parts["inertia"], key) for key in ENTRIES)
    return LinkInertia(mass, np.zeros(3), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _remark(place: str, stated: LinkInertia, findings: list[Finding]) -> None:
    if stated.mass == 0.0 and np.any(stated.inertia):
        findings.append(Finding(Severity.WARNING, place, "has inertia but no mass, as no body has; add the mass"))
    elif stated.mass > 0.0 and not np.any(stated.inertia):
        text = f"has mass {stated.mass:g} kg but no inertia, a point mass; some simulators refuse that"
        findings.append(Finding(Severity.INFO, place, text))
