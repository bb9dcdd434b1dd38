"""The identified model as a MuJoCo model file (MJCF)."""

from dataclasses import dataclass, replace

import numpy as np

from tauscope.errors import ExportError
from tauscope.export.actuators import ActuatorChoice, actuator_elements
from tauscope.export.compensation.source_code import comment_text
from tauscope.export.joint_model import JointModel, centred, dry_friction_and_damping, friction_notes, joint_models
from tauscope.export.mjcf_findings import NEWER, REST, Additions, JointExtras, add_findings, numbers
from tauscope.export.model import ExportModel
from tauscope.robot import JointLimits, JointType, Robot, Segment
from tauscope.robot.messages import one_line, shown

MOTORS = ActuatorChoice()  # torque motors, which need no gains


@dataclass(frozen=True)
class MjcfModel:
    """A MuJoCo model."""

    text: str
    notes: tuple[str, ...]


def to_mjcf(model: ExportModel, choice: ActuatorChoice = MOTORS) -> MjcfModel:
    """Write the arm as a complete MJCF: bodies, joints, inertials, friction, findings, an actuator a joint; no shapes.

    A body's frame is the link frame, and joint positions are the robot file's. damping = τ_v; frictionloss =
    τ_s + τ_sc, the Coulomb level at speed; armature is the rotor's inertia where it was identified, else 0. Raises
    ExportError if a joint's link cannot exist, or a number is not finite.
    """
    added = add_findings(model)
    robot, labels = added.robot, model.robot.segment_labels
    models = joint_models(robot, added.links, model.friction, model.rotor_inertia)
    names = [_quote(labels[link]) for link in robot.own_links]
    notes: list[str] = []
    lines: list[str] = []
    own_joints = {link: joint for joint, link in enumerate(robot.own_links)}
    for index, label in enumerate(labels):
        own = own_joints.get(index)
        extras = JointExtras() if own is None else added.joints[own]
        limits = JointLimits() if own is None else robot.joints[own].limits
        lines += [f"{'  ' * (index + 2)}{line}" for line in _body(robot, index, label, models[label], extras, limits)]
        if (friction := models[label].friction) is not None:
            notes += friction_notes(label, replace(friction, offset=0.0) if extras.has_offset else friction, "MJCF")
        if _xml_name(label) != label:
            notes.append(f"{label}: the name holds characters that XML cannot; they are written as U+FFFD.")
    lines += [f"{'  ' * (index + 2)}</body>" for index in reversed(range(robot.link_count))]
    rotors = [value or 0.0 for value in model.rotor_inertia]
    actuators, chosen = actuator_elements(robot, added.links, rotors, names, choice)
    tendons = tendon_elements(added, names)
    passive = [passive_elements(joint, extras, names) for joint, extras in enumerate(added.joints)]
    notes += [*added.notes, *chosen]
    if any(passive):
        notes.append(f"Cogging and bristles are passive dcmotor elements: this file {NEWER}.")
    if any(np.any(extras.damping) for extras in added.joints):
        notes.append(f"Damping of higher order: this file {NEWER}.")
    notes.append("Bodies have no shapes: nothing collides, and nothing is drawn but what MuJoCo draws for inertias.")
    comment = "".join(f"\n    {comment_text(note).replace('--', '- -')}" for note in notes)
    text = "\n".join(
        [
            f"<mujoco model={_quote(robot.name)}>",
            f"  <!-- Model identified by Tauscope.{comment} -->",
            '  <compiler angle="radian" autolimits="true"/>',
            f'  <option gravity="{numbers(*robot.gravity)}"/>',
            "  <worldbody>",
            *lines,
            "  </worldbody>",
            *_followers(robot, [_quote(label) for label in labels]),
            *(["  <tendon>", *(f"    {line}" for line in tendons), "  </tendon>"] if tendons else []),
            "  <actuator>",
            *(f"    {line}" for line in actuators),
            *(f"    {line}" for elements in passive for line in elements),
            "  </actuator>",
            "</mujoco>",
        ]
    )
    return MjcfModel(text + "\n", tuple(notes))


def passive_elements(joint: int, extras: JointExtras, names: list[str]) -> list[str]:
    """Passive torques of a joint, which have no control input and whose motor is switched off.

    `names`: of the joints, as quoted attribute values.
    """
    return [
        f'<dcmotor joint={names[joint]} resistance="1.0" motorconst="0.0 0.0" input="none" {each}/>'
        for each in extras.passive
    ]


def _followers(robot: Robot, names: list[str]) -> list[str]:
    lines: list[str] = []
    own = robot.own_links
    for link, coupling in enumerate(robot.couplings):
        master = own[coupling.joint]
        if link != master:
            terms = numbers(coupling.offset, coupling.multiplier, 0.0, 0.0, 0.0)
            lines.append(f'    <joint joint1={names[link]} joint2={names[master]} polycoef="{terms}"/>')
    return ["  <equality>", *lines, "  </equality>"] if lines else []


def tendon_elements(added: Additions, names: list[str]) -> list[str]:
    """Friction on the sum or difference of two joints' motion. `names`: of the joints, as quoted attribute values."""
    lines: list[str] = []
    for dry, damping, factors in added.tendons:
        lines.append(f'<fixed damping="{numbers(damping)}" frictionloss="{numbers(dry)}">')
        lines += [f'  <joint joint={names[joint]} coef="{numbers(by)}"/>' for joint, by in factors.items()]
        lines.append("</fixed>")
    return lines


def _body(
    robot: Robot, index: int, label: str, model: JointModel, extras: JointExtras, limits: JointLimits
) -> list[str]:
    from scipy.spatial.transform import Rotation

    if model.link is None:
        raise ExportError(one_line(f"joint {shown(label)} has no link to write; give the link of every joint"))
    inertia = centred(label, model.link)
    segment = robot.segments[index]
    # At q = 0 the link frame is before · after; the joint's axis is the z axis between the two.
    rotation = segment.before.rotation @ segment.after.rotation
    position = segment.before.rotation @ segment.after.translation + segment.before.translation
    quaternion = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    full = [inertia.inertia[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    name = _quote(f"{label}_link")
    return [
        f'<body name={name} pos="{numbers(*position)}" quat="{numbers(*quaternion)}">',
        f'  <inertial pos="{numbers(*inertia.centre)}" mass="{numbers(inertia.mass)}" fullinertia="{numbers(*full)}"/>',
        f"  {_joint(segment, label, model, extras, limits)}",
    ]


def _joint(segment: Segment, label: str, model: JointModel, extras: JointExtras, limits: JointLimits) -> str:
    after = segment.after
    attributes = {
        "type": "slide" if segment.type is JointType.PRISMATIC else "hinge",
        "axis": numbers(*after.rotation[2]),
        "pos": numbers(*(-after.rotation.T @ after.translation)),
    }
    if limits.position is not None:
        attributes["range"] = numbers(*limits.position)
    if model.friction is not None:
        dry, damping = dry_friction_and_damping(label, model.friction)
        orders = (damping, *extras.damping) if any(extras.damping) else (damping,)
        attributes |= {"damping": numbers(*orders), "frictionloss": numbers(max(0.0, dry - extras.dry_friction))}
        attributes |= REST
    attributes["armature"] = numbers(_armature(label, model))
    written = " ".join(f'{key}="{value}"' for key, value in (attributes | extras.attributes).items())
    return f"<joint name={_quote(label)} {written}/>"


def _armature(label: str, model: JointModel) -> float:
    armature = 0.0 if model.rotor_inertia is None else float(model.rotor_inertia)
    if not (np.isfinite(armature) and armature >= 0.0):
        text = f"joint {shown(label)}: rotor inertia {armature:g} must be 0 or more; export the consistent model"
        raise ExportError(one_line(text))
    return armature


def _quote(name: str) -> str:
    from xml.sax.saxutils import quoteattr  # loads urllib and ssl

    return quoteattr(_xml_name(name))


def _xml_name(name: str) -> str:
    """A name with every character that XML 1.0 cannot hold replaced by U+FFFD."""
    return "".join(
        c if c in "\t\n\r" or "\x20" <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" or c > "\uffff" else "\ufffd"
        for c in name
    )
