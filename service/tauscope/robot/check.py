"""What can be said about a robot file before any motion: a summary, and everything doubtful in it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from pydantic import Field

from tauscope.robot.kinematics import homogeneous
from tauscope.robot.messages import Finding, Severity
from tauscope.robot.robot import Joint, JointLimits, JointType, Robot, Segment
from tauscope.robot.robot_file import read_robot
from tauscope.strict_model import entry, take_fields

EARTH = (9.7, 9.9)  # acceleration of gravity on the ground, with room for altitude and latitude [m/s²]


@entry
class JointSummary:
    """One joint in the report."""

    number: int = Field(description="from 1, base first")
    name: str = Field(description="of the joint")
    type: JointType = Field(description="how it moves")
    limits: JointLimits = Field(description="what it may do; null where nothing is stated")
    gear_ratio: float | None = Field(description="motor turns per joint turn")
    torque_constant: float = Field(description="joint Nm (N) per recorded unit")
    sign: int = Field(description="-1 where the recorded torque is wired the other way round")
    origin: tuple[float, float, float] = Field(description="of the link frame at q = 0, in the frame before [m]")
    axis: tuple[float, float, float] = Field(description="unit vector of the joint axis, in the frame before")
    mass: float | None = Field(description="of the link that it carries, as the model believes [kg]")
    before: tuple[float, ...] = Field(description="4 × 4, by rows: link = before's · before · motion about z · after")
    after: tuple[float, ...] = Field(description="4 × 4 transform, row by row, from the joint to the link frame [m]")


@entry
class RobotReport:
    """A robot file at a glance."""

    name: str = Field(description="of the robot")
    gravity: tuple[float, float, float] = Field(description="in the base frame [m/s²]")
    total_mass: float | None = Field(description="of all moving links, as the model believes [kg]; null without one")
    joints: tuple[JointSummary, ...] = Field(description="base first")
    findings: tuple[Finding, ...] = Field(description="warnings first")


def check_robot(path: Path | str, *, expands_xacro: bool = True) -> RobotReport:
    """Report on a robot file, impossible links included. Raises RobotFileError where it cannot be read."""
    robot = read_robot(path, expands_xacro=expands_xacro)
    rank = list(Severity)
    findings = sorted((*robot.findings, *_remarks(robot, str(path))), key=lambda finding: rank.index(finding.severity))
    links = robot.model.links
    return RobotReport(
        name=robot.name,
        joints=tuple(
            _summary(number, joint, robot.segments[link], None if links is None else links[link].mass)
            for number, (joint, link) in enumerate(zip(robot.joints, robot.own_links, strict=True), start=1)
        ),
        gravity=_triple(robot.gravity),
        total_mass=None if links is None else float(sum(link.mass for link in links)),
        findings=tuple(findings),
    )


def _summary(number: int, joint: Joint, segment: Segment, mass: float | None) -> JointSummary:
    before, after = segment.before, segment.after
    return take_fields(
        JointSummary,
        joint,
        number=number,
        origin=_triple(before.translation + before.rotation @ after.translation),
        axis=_triple(before.rotation[:, 2]),
        mass=mass,
        before=tuple(homogeneous(before).ravel().tolist()),
        after=tuple(homogeneous(after).ravel().tolist()),
    )


def _remarks(robot: Robot, source: str) -> Iterator[Finding]:
    """What other commands repair, will miss or stumble over."""
    for note in robot.notes:
        place, _, text = note.text.partition(": ")
        yield Finding(Severity.INFO, place, f"{text}; {note.remedy}")
    for repair in robot.repairs:
        yield Finding(Severity.WARNING, repair.place, f"{repair.text}; {repair.remedy}")
    size = float(np.linalg.norm(robot.gravity))
    if not EARTH[0] <= size <= EARTH[1]:
        text = f"is {size:g} m/s², not 9.81: is the arm's weight balanced?"
        yield Finding(Severity.WARNING, f"{source}: gravity", text)
    for key in ("position", "velocity"):
        without = [joint.name for joint in robot.joints if getattr(joint.limits, key) is None]
        if without:
            text = f"no {key} limits for {', '.join(without)}; excite and run need them, identify and diagnose do not"
            yield Finding(Severity.INFO, f"{source}: joints", text)
    for number, friction in enumerate(robot.model.friction or (), start=1):
        place = f"{source}: model friction of joint {number} ({robot.joints[number - 1].name})"
        if friction.viscous < 0.0 or friction.stiction < 0.0 or friction.stiction + friction.stribeck < 0.0:
            yield Finding(Severity.WARNING, place, "friction drives the joint instead of braking it; check the signs")
    missing = " and ".join(f"no {part}" for part in ("links", "friction") if getattr(robot.model, part) is None)
    if missing:
        text = f"{missing} stated; diagnose --against model compares only what the model states"
        yield Finding(Severity.INFO, f"{source}: model", text)


def _triple(vector: np.ndarray) -> tuple[float, float, float]:
    return tuple(vector.tolist())
