"""The identified model written into the user's own MJCF: inertials, joints and passive torques, nothing else."""

from collections.abc import Iterator
from math import degrees
from pathlib import Path

import numpy as np

from tauscope.errors import ExportError
from tauscope.export.compensation.source_code import comment_text
from tauscope.export.joint_model import CentredInertia, centred, numbers, without_branch
from tauscope.export.mjcf import passive_elements, tendon_elements
from tauscope.export.mjcf_findings import MjcfSegment, add_findings
from tauscope.export.model import ExportModel
from tauscope.export.xml_spans import Element, XmlText
from tauscope.robot.messages import nearest, shown

_MARKER = "Model identified by Tauscope."


def patch_mjcf(path: Path, model: ExportModel) -> bytes:
    """Write links, friction, rotors and findings into an MJCF; every other byte stays.

    The body of each joint gets an ``<inertial>`` about its centre of mass; bodies fixed to it keep theirs. Raises
    ExportError if the file is no MJCF, does not hold a joint itself or holds earlier findings, or the model is of
    another file.
    """
    if not model.origin.is_mjcf:
        text = "the model comes from another file than an MJCF; give this MJCF as ROBOT to identify or diagnose"
        raise ExportError(f"{path}: {text}")
    try:
        text = XmlText(path.read_bytes(), str(path))
    except OSError as error:
        raise ExportError(f"{path}: cannot be read: {error.strerror}; check the path") from None
    if text.root.name != "mujoco":
        raise ExportError(f"{path}: the outermost element is <{text.root.name}>, not <mujoco>; give an MJCF")
    added = add_findings(model, without=("base_tilt", "kinematic_error"))
    places = {joint.attributes.get("name", ""): (body, joint) for body, joint in _joints(text.root)}
    notes = list(added.notes)
    for segment in added.segments(model):
        label, link = segment.label, segment.model.link
        if label not in places:
            hint = nearest(label, places)
            raise ExportError(f"{path}: joint {shown(label)} is not in the file itself; {hint}")
        body, joint = places[label]
        if link is not None and np.any(link.to_vector()):  # of several joints of one body, only the last has it
            own, remarks = without_branch(label, segment.model)
            notes += remarks
            _write_inertial(text, body, centred(label, own))
        text.set_attributes(joint, _joint_attributes(text.root, segment))
        notes += segment.notes
    names = [f'"{model.robot.segment_labels[link]}"' for link in model.robot.own_links]
    passive = [line for joint, extras in enumerate(added.joints) for line in passive_elements(joint, extras, names)]
    tendons = tendon_elements(added, names)
    if (passive or tendons) and _MARKER.encode() in text.data:
        raise ExportError(f"{path}: holds findings of an earlier export; give the file as it was before")
    _append(text, "actuator", passive)
    _append(text, "tendon", tendons)
    text.set_comment(text.root, _MARKER, "".join(f"\n       {comment_text(note)}" for note in notes))
    return text.edited()


def _joints(element: Element) -> Iterator[tuple[Element, Element]]:
    for child in element.children:
        if child.name == "joint" and element.name == "body":
            yield element, child
        if child.name != "default":
            yield from _joints(child)


def _write_inertial(text: XmlText, body: Element, inertia: CentredInertia) -> None:
    centre, mass, full = numbers(*inertia.centre), numbers(inertia.mass), numbers(*inertia.full)
    line = f'<inertial pos="{centre}" mass="{mass}" fullinertia="{full}"/>'
    stated = next(body.named("inertial"), None)
    if stated is None:
        text.append_child(body, [line])
    else:
        text.replace_element(stated, line)


def _joint_attributes(root: Element, segment: MjcfSegment) -> dict[str, str]:
    """Attributes of a joint that the model determines; a joint that follows has its part in its master's."""
    attributes = segment.extras.attributes | {"damping": "0.0", "frictionloss": "0.0"}
    is_radian = any(compiler.attributes.get("angle") == "radian" for compiler in root.named("compiler"))
    if "springref" in attributes and not is_radian:  # degrees are MuJoCo's default
        attributes["springref"] = numbers(degrees(float(attributes["springref"])))
    if segment.model.friction is not None:
        attributes |= segment.extras.friction_attributes(segment.label, segment.model.friction)
    # A rotor that was not identified by itself is part of the links.
    return attributes | {"armature": numbers(segment.model.rotor_inertia or 0.0)}


def _append(text: XmlText, kind: str, lines: list[str]) -> None:
    """Add lines to the section of a kind, which is made where there is none."""
    if not lines:
        return
    section = next(text.root.named(kind), None)
    if section is None:
        text.append_child(text.root, [f"<{kind}>", *(f"  {line}" for line in lines), f"</{kind}>"])
    else:
        text.append_child(section, lines)
