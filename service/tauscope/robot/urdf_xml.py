"""URDF text to links and joints: safe XML, checked names, and a tree without loops."""

from collections.abc import Mapping
from dataclasses import dataclass

from lxml import etree

from tauscope.errors import RobotFileError
from tauscope.robot.bounded_file import decode_utf8
from tauscope.robot.document_fields import LONGEST_NAME
from tauscope.robot.messages import nearest, one_line, shown
from tauscope.robot.urdf_element import Element, children, urdf_error

LARGEST_URDF = 16 * 1024 * 1024
JOINT_TYPES = frozenset({"revolute", "continuous", "prismatic", "fixed", "floating", "planar"})
XACRO = frozenset({"http://www.ros.org/wiki/xacro", "http://ros.org/wiki/xacro"})


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


def parse_urdf(data: bytes, label: str) -> UrdfTree:
    """Links and joints of URDF text.

    Raises
    ------
    RobotFileError
        if the text is not well-formed, holds a DOCTYPE, or its links and joints are no forest
    """
    root = _parse_xml(data, label)
    if etree.QName(root).localname != "robot":
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


def _parse_xml(data: bytes, label: str) -> Element:
    """The root element; nothing is fetched, and a DOCTYPE is refused before entities can be expanded."""
    text = decode_utf8(data, label)
    doctype = text.find("<!DOCTYPE")
    if doctype >= 0:
        line = text.count("\n", 0, doctype) + 1
        raise RobotFileError(one_line(f"{label}:{line}: a DOCTYPE is not accepted in a URDF; remove it"))
    parser = etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(text.encode("utf-8"), parser)
    except etree.XMLSyntaxError as error:
        raise RobotFileError(one_line(f"{label}:{error.lineno or 1}: not valid XML: {error.msg}")) from None
    except (ValueError, MemoryError) as error:
        raise RobotFileError(one_line(f"{label}: not valid XML: {error}")) from error
    for element in root.iter():
        if isinstance(element.tag, str) and etree.QName(element).namespace in XACRO:
            raise urdf_error(
                label, element, "the file is a xacro; expand it first, with ros2 run xacro xacro FILE > arm.urdf"
            )
    return root


def _joint(label: str, element: Element, links: Mapping[str, Element]) -> UrdfJoint:
    """A joint element with checked names."""
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
    """The name of a link or joint."""
    name = element.get("name")
    if not name or not name.strip() or len(name) > LONGEST_NAME or not name.isprintable():
        raise urdf_error(label, element, f"needs a printable name of at most {LONGEST_NAME} characters")
    return name
