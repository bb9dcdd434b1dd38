"""The identified model as a MuJoCo model file (MJCF)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tauscope.errors import ExportError
from tauscope.export.compensation.identifiers import comment_text
from tauscope.export.joint_model import JointModel, centred, dry_friction_and_damping, friction_notes
from tauscope.robot import Joint, JointType, Robot
from tauscope.robot.messages import one_line, shown


@dataclass(frozen=True)
class MjcfModel:
    """A MuJoCo model."""

    text: str
    notes: tuple[str, ...]


def to_mjcf(robot: Robot, models: Mapping[str, JointModel]) -> MjcfModel:
    """Write the arm as a complete MJCF: bodies, joints, inertials, friction, one motor a joint; no shapes.

    A body's frame is the link frame, and joint positions are the robot file's. damping = τ_v; frictionloss =
    τ_s + τ_sc, the Coulomb level at speed; armature is the rotor's inertia where it was identified, else 0.

    Raises
    ------
    ExportError
        if a joint's link is missing or cannot exist, or a number is not finite
    """
    notes: list[str] = []
    lines: list[str] = []
    for index, joint in enumerate(robot.joints):
        model = models.get(joint.name, JointModel())
        lines += [f"{'  ' * (index + 2)}{line}" for line in _body(robot, index, joint, model)]
        if model.friction is not None:
            notes += friction_notes(joint.name, model.friction, "MJCF")
        if _xml_name(joint.name) != joint.name:
            notes.append(f"{joint.name}: the name holds characters that XML cannot; they are written as U+FFFD.")
    lines += [f"{'  ' * (index + 2)}</body>" for index in reversed(range(robot.joint_count))]
    notes.append("Bodies have no shapes: nothing collides, and nothing is drawn but what MuJoCo draws for inertias.")
    comment = "".join(f"\n    {comment_text(note).replace('--', '- -')}" for note in notes)
    text = "\n".join(
        [
            f"<mujoco model={_quoted(robot.name)}>",
            f"  <!-- Model identified by Tauscope.{comment} -->",
            '  <compiler angle="radian" autolimits="true"/>',
            f'  <option gravity="{_numbers(*robot.gravity)}"/>',
            "  <worldbody>",
            *lines,
            "  </worldbody>",
            "  <actuator>",
            *(f"    {_motor(joint)}" for joint in robot.joints),
            "  </actuator>",
            "</mujoco>",
        ]
    )
    return MjcfModel(text + "\n", tuple(notes))


def _body(robot: Robot, index: int, joint: Joint, model: JointModel) -> list[str]:
    """Start tag, inertial and joint of one body."""
    from scipy.spatial.transform import Rotation

    if model.link is None:
        raise ExportError(one_line(f"joint {shown(joint.name)} has no link to write; give the link of every joint"))
    inertia = centred(joint.name, model.link)
    segment = robot.segments[index]
    # At q = 0 the link frame is before · after; the joint's axis is the z axis between the two.
    rotation = segment.before.rotation @ segment.after.rotation
    position = segment.before.rotation @ segment.after.translation + segment.before.translation
    quaternion = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    full = [inertia.inertia[row, column] for row, column in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    name = _quoted(f"{joint.name}_link")
    return [
        f'<body name={name} pos="{_numbers(*position)}" quat="{_numbers(*quaternion)}">',
        f'  <inertial pos="{_numbers(*inertia.centre)}" mass="{_numbers(inertia.mass)}" '
        f'fullinertia="{_numbers(*full)}"/>',
        f"  {_joint(robot, index, joint, model)}",
    ]


def _joint(robot: Robot, index: int, joint: Joint, model: JointModel) -> str:
    """The joint element: axis, limits, friction and armature."""
    after = robot.segments[index].after
    slides = joint.type is JointType.PRISMATIC
    attributes = {
        "type": "slide" if slides else "hinge",
        "axis": _numbers(*after.rotation[2]),
        "pos": _numbers(*(-after.rotation.T @ after.translation)),
    }
    if joint.limits.position is not None:
        attributes["range"] = _numbers(*joint.limits.position)
    if model.friction is not None:
        dry, damping = dry_friction_and_damping(joint.name, model.friction)
        attributes |= {"damping": _numbers(damping), "frictionloss": _numbers(dry)}
    attributes["armature"] = _numbers(_armature(joint, model))
    written = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return f"<joint name={_quoted(joint.name)} {written}/>"


def _armature(joint: Joint, model: JointModel) -> float:
    """The rotor's reflected inertia, 0 where none was identified."""
    armature = 0.0 if model.rotor_inertia is None else float(model.rotor_inertia)
    if not (np.isfinite(armature) and armature >= 0.0):
        text = f"joint {shown(joint.name)}: rotor inertia {armature:g} must be 0 or more; export the consistent model"
        raise ExportError(one_line(text))
    return armature


def _motor(joint: Joint) -> str:
    """A torque motor on a joint, limited where the robot file states a limit."""
    name = _quoted(joint.name)
    limit = joint.limits.torque
    control = "" if limit is None else f' ctrlrange="{_numbers(-limit, limit)}"'
    return f"<motor name={name} joint={name}{control}/>"


def _quoted(name: str) -> str:
    """A name as the value of an attribute."""
    from xml.sax.saxutils import quoteattr  # loads urllib and ssl

    return quoteattr(_xml_name(name))


def _xml_name(name: str) -> str:
    """A name with every character that XML 1.0 cannot hold replaced by U+FFFD."""
    return "".join(
        c if c in "\t\n\r" or "\x20" <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" or c > "\uffff" else "\ufffd"
        for c in name
    )


def _numbers(*values: float | np.float64) -> str:
    """Numbers that read back as the same float64; no negative zero."""
    return " ".join(repr(float(value) + 0.0) for value in values)
