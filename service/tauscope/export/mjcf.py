"""The identified model as a MuJoCo model file (MJCF)."""

from dataclasses import dataclass

import numpy as np

from tauscope.errors import ExportError
from tauscope.export.actuators import ActuatorChoice, actuator_elements
from tauscope.export.compensation.source_code import comment_text
from tauscope.export.joint_model import centred, numbers
from tauscope.export.mjcf_findings import NEWER, Additions, JointExtras, MjcfSegment, add_findings
from tauscope.export.model import ExportModel
from tauscope.robot import JointType, Robot, Segment
from tauscope.robot.kinematics import compose
from tauscope.robot.messages import shown

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
    names = [_quote(labels[link]) for link in robot.own_links]
    notes: list[str] = []
    lines: list[str] = []
    for index, segment in enumerate(added.segments(model)):
        lines += [f"{'  ' * (index + 2)}{line}" for line in _body(robot.segments[index], segment)]
        notes += segment.notes
        if _xml_name(segment.label) != segment.label:
            notes.append(f"{segment.label}: the name holds characters that XML cannot; they are written as U+FFFD.")
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
    """Passive torques of a joint, by its quoted name; no control input, and its motor is switched off."""
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


def _body(motion: Segment, segment: MjcfSegment) -> list[str]:
    from scipy.spatial.transform import Rotation

    label, link = segment.label, segment.model.link
    if link is None:
        raise ExportError(f"joint {shown(label)} has no link to write; give the link of every joint")
    inertia = centred(label, link)
    centre, mass, full = numbers(*inertia.centre), numbers(inertia.mass), numbers(*inertia.full)
    # At q = 0 the link frame is before · after; the joint's axis is the z axis between the two.
    frame = compose(motion.before, motion.after)
    quaternion = Rotation.from_matrix(frame.rotation).as_quat(scalar_first=True)
    name = _quote(f"{label}_link")
    return [
        f'<body name={name} pos="{numbers(*frame.translation)}" quat="{numbers(*quaternion)}">',
        f'  <inertial pos="{centre}" mass="{mass}" fullinertia="{full}"/>',
        f"  {_joint(motion, segment)}",
    ]


def _joint(motion: Segment, segment: MjcfSegment) -> str:
    after, model, extras = motion.after, segment.model, segment.extras
    attributes = {
        "type": "slide" if motion.type is JointType.PRISMATIC else "hinge",
        "axis": numbers(*after.rotation[2]),
        "pos": numbers(*(-after.rotation.T @ after.translation)),
    }
    if segment.joint is not None and segment.joint.limits.position is not None:
        attributes["range"] = numbers(*segment.joint.limits.position)
    if model.friction is not None:
        attributes |= extras.friction_attributes(segment.label, model.friction)
    armature = model.rotor_inertia or 0.0
    if not 0.0 <= armature < np.inf:
        text = (
            f"joint {shown(segment.label)}: rotor inertia {armature:g} must be 0 or more; export the consistent model"
        )
        raise ExportError(text)
    attributes["armature"] = numbers(armature)
    written = " ".join(f'{key}="{value}"' for key, value in (attributes | extras.attributes).items())
    return f"<joint name={_quote(segment.label)} {written}/>"


def _quote(name: str) -> str:
    from xml.sax.saxutils import quoteattr  # loads urllib and ssl

    return quoteattr(_xml_name(name))


def _xml_name(name: str) -> str:
    """A name with every character that XML 1.0 cannot hold replaced by U+FFFD."""
    return "".join(
        c if c in "\t\n\r" or "\x20" <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" or c > "\uffff" else "\ufffd"
        for c in name
    )
