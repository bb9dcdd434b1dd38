"""The identified model written into the user's own MJCF: inertials, joints and passive torques, nothing else."""

from collections.abc import Iterator
from dataclasses import replace
from math import degrees
from pathlib import Path

import numpy as np

from tauscope.errors import ExportError
from tauscope.export.compensation.source_code import comment_text
from tauscope.export.joint_model import (
    CentredInertia,
    JointModel,
    centred,
    dry_friction_and_damping,
    friction_notes,
    joint_models,
    without_branch,
)
from tauscope.export.mjcf import passive_elements, tendon_elements
from tauscope.export.mjcf_findings import REST, JointExtras, add_findings, numbers
from tauscope.export.model import ExportModel
from tauscope.export.xml_spans import Element, XmlText
from tauscope.robot.messages import nearest, one_line, shown

_MARKER = "Model identified by Tauscope."


def patch_mjcf(path: Path, model: ExportModel) -> bytes:
    """Write links, friction, rotors and findings into an MJCF; every other byte stays.

    The body of each joint gets an ``<inertial>`` about its centre of mass; bodies fixed to it keep theirs. Raises
    ExportError if the file is no MJCF, does not hold a joint itself or holds earlier findings, or the model is of
    another file.
    """
    if not model.origin.is_mjcf:
        text = "the model comes from another file than an MJCF; give this MJCF as ROBOT to identify or diagnose"
        raise ExportError(one_line(f"{path}: {text}"))
    try:
        text = XmlText(path.read_bytes(), str(path))
    except OSError as error:
        raise ExportError(one_line(f"{path}: cannot be read: {error.strerror}; check the path")) from None
    if text.root.name != "mujoco":
        raise ExportError(one_line(f"{path}: the outermost element is <{text.root.name}>, not <mujoco>; give an MJCF"))
    added = add_findings(model, without=("base_tilt", "kinematic_error"))
    robot, labels = model.robot, model.robot.segment_labels
    models = joint_models(robot, added.links, model.friction, model.rotor_inertia)
    own = {link: joint for joint, link in enumerate(robot.own_links)}
    places = {joint.attributes.get("name", ""): (body, joint) for body, joint in _joints(text.root)}
    notes = list(added.notes)
    for index, label in enumerate(labels):
        if label not in places:
            hint = nearest(label, places)
            raise ExportError(one_line(f"{path}: joint {shown(label)} is not in the file itself; {hint}"))
        body, joint = places[label]
        link, remarks = without_branch(label, models[label]) if _weighs(models[label]) else (None, [])
        notes += remarks
        if link is not None:
            _write_inertial(text, body, centred(label, link))
        extras = added.joints[own[index]] if index in own else JointExtras()
        text.set_attributes(joint, _joint_attributes(text.root, label, models[label], extras))
        if (friction := models[label].friction) is not None:
            notes += friction_notes(label, replace(friction, offset=0.0) if extras.has_offset else friction, "MJCF")
    names = [f'"{labels[link]}"' for link in robot.own_links]
    passive = [line for joint, extras in enumerate(added.joints) for line in passive_elements(joint, extras, names)]
    tendons = tendon_elements(added, names)
    if (passive or tendons) and _MARKER.encode() in text.data:
        raise ExportError(one_line(f"{path}: holds findings of an earlier export; give the file as it was before"))
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


def _weighs(model: JointModel) -> bool:
    """Whether a segment has a body: of several joints of one body, only the last has."""
    return model.link is not None and bool(np.any(model.link.to_vector()))


def _write_inertial(text: XmlText, body: Element, inertia: CentredInertia) -> None:
    full = [inertia.inertia[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    line = f'<inertial pos="{numbers(*inertia.centre)}" mass="{numbers(inertia.mass)}" fullinertia="{numbers(*full)}"/>'
    stated = next(body.named("inertial"), None)
    if stated is None:
        text.append_child(body, [line])
    else:
        text.replace_element(stated, line)


def _joint_attributes(root: Element, label: str, model: JointModel, extras: JointExtras) -> dict[str, str]:
    """Attributes of a joint that the model determines; a joint that follows has its part in its master's."""
    attributes = dict(extras.attributes) | {"damping": "0.0", "frictionloss": "0.0"}
    if "springref" in attributes and _uses_degrees(root):
        attributes["springref"] = numbers(degrees(float(attributes["springref"])))
    if model.friction is not None:
        dry, damping = dry_friction_and_damping(label, model.friction)
        orders = (damping, *extras.damping) if any(extras.damping) else (damping,)
        attributes |= {"damping": numbers(*orders), "frictionloss": numbers(max(0.0, dry - extras.dry_friction))}
        attributes |= REST
    # A rotor that was not identified by itself is part of the links.
    return attributes | {"armature": numbers(model.rotor_inertia or 0.0)}


def _uses_degrees(root: Element) -> bool:
    """Whether angles of the file are in degrees, MuJoCo's default."""
    return not any(compiler.attributes.get("angle") == "radian" for compiler in root.named("compiler"))


def _append(text: XmlText, kind: str, lines: list[str]) -> None:
    """Add lines to the section of a kind, which is made where there is none."""
    if not lines:
        return
    section = next(text.root.named(kind), None)
    if section is None:
        text.append_child(text.root, [f"<{kind}>", *(f"  {line}" for line in lines), f"</{kind}>"])
    else:
        text.append_child(section, lines)
