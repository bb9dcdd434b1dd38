"""A robot as plain data for JSON, and back, under the validation of robot files."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from tauscope.robot.document import DocumentOrigin, PlainRobotDocument
from tauscope.robot.messages import shown
from tauscope.robot.robot import Joint, LinkInertia, Model, Placement, Robot, Segment
from tauscope.robot.robot_building import SourceFile, build_robot


def robot_from_dict(data: Mapping[str, Any], label: str = "robot") -> Robot:
    """The robot of plain data, no file opened. Raises RobotFileError, which names the JSON path and joint."""
    origin = DocumentOrigin(label, data)

    def refuse(kind: str, file: str) -> SourceFile:
        text = f"the file {shown(file)} is not among the given ones; no such file was given"
        raise origin.error(("kinematics", kind, "file"), text)

    return build_robot(origin.validate(PlainRobotDocument), origin, refuse)


def robot_to_dict(robot: Robot) -> dict[str, Any]:
    """All that computing with the robot needs, for `robot_from_dict`, without paths, names of links and findings."""
    data: dict[str, Any] = {
        "name": robot.name,
        "kinematics": {"segments": [_segment(segment) for segment in robot.segments]},
        "gravity": robot.gravity.tolist(),
        "joints": [_joint(joint) for joint in robot.joints],
    }
    recording = {key: value for key, value in asdict(robot.recording).items() if value} or None
    return {**data, **_drop_none({"model": _model(robot.model) or None, "recording": recording})}


def _segment(segment: Segment) -> dict[str, Any]:
    coupling = None if segment.coupling is None else asdict(segment.coupling)
    placements = {"before": _placement(segment.before), "after": _placement(segment.after)}
    return _drop_none({"type": segment.type.value, **placements, "coupling": coupling})


def _placement(placement: Placement) -> dict[str, Any]:
    return {"rotation": placement.rotation.tolist(), "translation": placement.translation.tolist()}


def _joint(joint: Joint) -> dict[str, Any]:
    limits = asdict(joint.limits)
    if joint.limits.position is not None:
        limits["position"] = list(joint.limits.position)
    is_stated = joint.has_torque_constant or joint.torque_constant != Joint.torque_constant
    return _drop_none(
        {
            "name": joint.name,
            "limits": _drop_none(limits) or None,
            "gear_ratio": joint.gear_ratio,
            "torque_constant": joint.torque_constant if is_stated else None,
            "sign": joint.sign,
            "friction_shape": _drop_none(asdict(joint.friction_shape)) or None,
            "drive": None if joint.drive is None else dict(joint.drive),
            "actuator": (a := joint.actuator) and _drop_none(asdict(a) | ({} if a.has_loop else {"kp": None})),
        }
    )


def _model(model: Model) -> dict[str, Any]:
    links = None if model.links is None else [link_to_dict(link) for link in model.links]
    friction = None if model.friction is None else [asdict(each) for each in model.friction]
    rotors = None if model.rotor_inertia is None else list(model.rotor_inertia)
    return _drop_none({"links": links, "friction": friction, "rotor_inertia": rotors})


def link_to_dict(link: LinkInertia) -> dict[str, Any]:
    """A link as a robot file states it."""
    *inertia, mass, _, _, _ = link.to_vector().tolist()
    entries = dict(zip(("xx", "yy", "zz", "xy", "xz", "yz"), inertia, strict=True))
    return {"mass": mass, "first_moment": link.first_moment.tolist(), "inertia": entries}


def _drop_none(mapping: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in mapping.items() if value is not None}
