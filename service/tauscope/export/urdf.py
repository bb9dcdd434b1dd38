"""The identified model written into the user's own URDF: inertials and joint dynamics, nothing else."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tauscope.errors import ExportError
from tauscope.export import joint_model
from tauscope.export.compensation.model import JointFriction
from tauscope.export.compensation.source_code import comment_text
from tauscope.export.xml_spans import Element, XmlText
from tauscope.robot.messages import nearest, shown

_MARKER = "Model identified by Tauscope."
_INERTIA = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))


@dataclass(frozen=True)
class PatchedUrdf:
    """A URDF with the identified model in it."""

    data: bytes
    notes: tuple[str, ...]


def patch_urdf(
    source: bytes | Path, models: Mapping[str, joint_model.JointModel], remarks: Sequence[str] = ()
) -> PatchedUrdf:
    """Write links and friction into a URDF in place; comments, meshes, order and white space stay byte for byte.

    An ``<inertial>`` gets the centre of mass, rpy 0, and the inertia about it along the link frame's axes, a joint's
    ``<dynamics>`` damping = τ_v and friction = τ_s + τ_sc. Links on fixed joints below are part of the identified link:
    their inertials become zero, for simulators make up a mass for a shape without one. Bodies on joints beside the
    chain stay, their mass is taken off the link that carries them. `remarks`: further lines of the comment. Raises
    ExportError if it is no URDF, a joint is not in it or does not move, or a link cannot exist.
    """
    data, label = _read(source)
    text = XmlText(data, label)
    if text.root.name.rpartition(":")[2] != "robot":
        raise ExportError(f"{label}: the outermost element is <{text.root.name}>, not <robot>; give a URDF")
    tree = _Tree(text.root, label)
    notes: list[str] = []
    for name, model in models.items():
        joint = tree.moving_joint(name)
        if model.link is not None:
            own, moved = joint_model.without_branch(name, model)
            notes += moved
            _write_inertial(text, tree.link(joint.child), joint_model.centred(name, own))
            notes += _zero_fixed_children(text, tree, joint.child, frozenset(models))
        if model.friction is not None:
            notes += _write_dynamics(text, joint.element, name, model.friction)
        if model.rotor_inertia:
            notes.append(f"{name}: URDF has no rotor inertia; the identified value is {model.rotor_inertia:.6g}.")
    notes += remarks
    lines = [comment_text(note) for note in notes]
    text.set_comment(text.root, _MARKER, "".join(f"\n       {line}" for line in lines))
    return PatchedUrdf(text.edited(), tuple(notes))


@dataclass(frozen=True, eq=False)
class _Joint:
    """A joint element, its type and the names of the links that it joins."""

    element: Element
    type: str
    parent: str
    child: str


class _Tree:
    """Links and joints of a URDF by name."""

    def __init__(self, root: Element, label: str) -> None:
        self.label = label
        self._links = {link.attributes.get("name", ""): link for link in root.named("link")}
        self._joints = {joint.attributes.get("name", ""): _joint(joint) for joint in root.named("joint")}

    def link(self, name: str) -> Element:
        if name not in self._links:
            raise ExportError(f"{self.label}: link {shown(name)} is not in the file; add it")
        return self._links[name]

    def moving_joint(self, name: str) -> _Joint:
        """The joint of a name, which must move."""
        joint = self._joints.get(name)
        if joint is None:
            hint = nearest(name, self._joints)
            raise ExportError(f"{self.label}: joint {shown(name)} is not in the file; {hint}")
        if joint.type == "fixed":
            text = f"joint {shown(name)} is fixed; name the moving joint that carries its link"
            raise ExportError(f"{self.label}: {text}")
        return joint

    def below(self, link: str) -> list[tuple[str, _Joint]]:
        """Joints that hang on a link."""
        return [(name, joint) for name, joint in self._joints.items() if joint.parent == link]


def _read(source: bytes | Path) -> tuple[bytes, str]:
    if isinstance(source, bytes):
        return source, "URDF"
    try:
        return source.read_bytes(), str(source)
    except OSError as error:
        raise ExportError(f"{source}: cannot be read: {error.strerror}; check the path") from None


def _joint(element: Element) -> _Joint:
    ends = [next((e.attributes.get("link", "") for e in element.named(end)), "") for end in ("parent", "child")]
    return _Joint(element, element.attributes.get("type", ""), ends[0], ends[1])


def _write_inertial(text: XmlText, link: Element, inertia: joint_model.CentredInertia) -> None:
    values = {
        "origin": {"xyz": joint_model.numbers(*inertia.centre), "rpy": "0 0 0"},
        "mass": {"value": joint_model.numbers(inertia.mass)},
        "inertia": {key: joint_model.numbers(inertia.inertia[row, column]) for key, row, column in _INERTIA},
    }
    tags = {kind: _tag(f"{link.prefix}{kind}", attributes) for kind, attributes in values.items()}
    inertials = list(link.named("inertial"))
    if not inertials:
        name = f"{link.prefix}inertial"
        text.append_child(link, [f"<{name}>", *(f"  {tag}" for tag in tags.values()), f"</{name}>"])
    for inertial in inertials:
        missing = [tag for kind, tag in tags.items() if not any(inertial.named(kind))]
        if missing:
            text.append_child(inertial, missing)
        for kind, attributes in values.items():
            for element in inertial.named(kind):
                # Another way to write a rotation, where present, must not contradict rpy.
                turned = {"quat_xyzw": "0 0 0 1"} if "quat_xyzw" in element.attributes else {}
                text.set_attributes(element, attributes | turned)


def _zero_fixed_children(text: XmlText, tree: _Tree, link: str, identified: frozenset[str]) -> list[str]:
    """Zero the inertials of the links that a link carries on fixed joints; say so, and what moves beside the model."""
    notes = []
    seen, waiting = {link}, [link]
    while waiting:
        for name, below in tree.below(waiting.pop()):
            if below.type != "fixed":
                if name not in identified:
                    notes.append(
                        f"{below.child} moves on joint {name} beside the chain: it is left as it was. Link {link} has "
                        "the identified mass less that of the branch."
                    )
            elif below.child not in seen:
                seen.add(below.child)
                waiting.append(below.child)
                notes += _zero_inertial(text, tree.link(below.child), below.child, name, link)
    return notes


def _zero_inertial(text: XmlText, element: Element, name: str, joint: str, carrier: str) -> list[str]:
    """Zero one link's inertial, because its mass is part of the link that carries it."""
    inertials = list(element.named("inertial"))
    for inertial in inertials:
        for mass in inertial.named("mass"):
            text.set_attributes(mass, {"value": "0"})
        for inertia in inertial.named("inertia"):
            text.set_attributes(inertia, {key: "0" for key, _, _ in _INERTIA})
    if inertials:
        return [
            f"The mass of link {name}, on fixed joint {joint}, is part of link {carrier}: its inertial is set to zero."
        ]
    if any(element.named("collision")):
        return [
            f"Link {name}, on fixed joint {joint}, has shapes but no inertial: some simulators make up a mass for it, "
            f"which is already part of link {carrier}."
        ]
    return []


def _write_dynamics(text: XmlText, element: Element, name: str, friction: JointFriction) -> list[str]:
    dry, damping = joint_model.dry_friction_and_damping(name, friction)
    values = {"damping": joint_model.numbers(damping), "friction": joint_model.numbers(dry)}
    existing = list(element.named("dynamics"))
    for dynamics in existing:
        text.set_attributes(dynamics, values)
    if not existing:
        text.append_child(element, [_tag(f"{element.prefix}dynamics", values)])
    return joint_model.friction_notes(name, friction, "URDF")


def _tag(name: str, attributes: Mapping[str, str]) -> str:
    return f"<{name} " + " ".join(f'{key}="{value}"' for key, value in attributes.items()) + "/>"
