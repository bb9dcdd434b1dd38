"""Robot files that a request brings, kept in a folder of their own, and what is said of them."""

from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import Field

from tauscope.errors import RobotFileError
from tauscope.robot import JointType, RobotReport, Severity
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.xml_text import LARGEST_XML
from tauscope.server.http.answers import AnswerModel
from tauscope.server.http.bodies import PartRule, to_json_text
from tauscope.server.queue.received_robot import INLINE_NAME
from tauscope.server.store.robots import RobotVersion
from tauscope.strict_model import StrictModel

EXAMPLE_ROBOT: dict[str, Any] = {
    "name": "pendulum",
    "kinematics": {"dh": [{"theta": 0, "d": 0, "a": 0.5, "alpha": 0}]},
    "gravity": [0, -9.81, 0],
    "joints": [{"name": "hinge", "limits": {"position": [-2.9, 2.9], "velocity": 2}}],
    "model": {
        "links": [
            {
                "mass": 1,
                "first_moment": [-0.25, 0, 0],
                "inertia": {"xx": 0.01, "yy": 0.1, "zz": 0.1, "xy": 0, "xz": 0, "yz": 0},
            }
        ]
    },
}
"""Every example of a request repeats it: as small as a robot can be."""


class RobotCheckRequest(StrictModel):
    """A robot to be checked."""

    robot: dict[str, Any] = Field(description="content of a robot file")


class RobotVersionAnswer(AnswerModel):
    version: str = Field(description="of its content; a request's robot may be {version: …}")
    name: str = Field(description="as in its file")
    robot_file: str = Field(description="which of its files is the robot file")
    created: datetime = Field(description="when it was kept, UTC")
    link: str = Field(description="path of its resource")

    @classmethod
    def of(cls, robot: RobotVersion) -> "RobotVersionAnswer":
        return cls(**asdict(robot), link=f"/api/v1/robots/versions/{robot.version}")


class LimitsAnswer(AnswerModel):
    """What a joint may do; null where nothing is stated."""

    position: tuple[float, float] | None = Field(description="lowest and highest position [rad or m]")
    velocity: float | None = Field(description="largest speed [rad/s or m/s]")
    acceleration: float | None = Field(description="largest acceleration [rad/s² or m/s²]")
    torque: float | None = Field(description="largest torque [Nm] or force [N]")


class JointAnswer(AnswerModel):
    number: int = Field(description="from 1, base first")
    name: str = Field(description="of the joint")
    type: JointType = Field(description="how it moves")
    limits: LimitsAnswer = Field(description="what it may do")
    gear_ratio: float | None = Field(description="motor turns per joint turn")
    torque_constant: float = Field(description="joint Nm (N) per recorded unit")
    sign: int = Field(description="-1 where the recorded torque is wired the other way round")
    origin: tuple[float, float, float] = Field(description="of the link frame at q = 0, in the frame before [m]")
    axis: tuple[float, float, float] = Field(description="unit vector of the joint axis, in the frame before")
    mass: float | None = Field(description="of the link that it carries, as the model believes [kg]")
    before: tuple[float, ...] = Field(description="4 × 4, by rows: link = before's · before · motion about z · after")
    after: tuple[float, ...] = Field(description="4 × 4 transform, row by row, from the joint to the link frame [m]")


class FindingAnswer(AnswerModel):
    severity: Severity = Field(description="warning: may spoil results; info: good to know")
    where: str = Field(description="file and place, or column, that it is about")
    text: str = Field(description="what is so, and what to do about it")


class RobotReportAnswer(AnswerModel):
    name: str = Field(description="of the robot")
    gravity: tuple[float, float, float] = Field(description="in the base frame [m/s²]")
    total_mass: float | None = Field(description="of all moving links, as the model believes [kg]")
    joints: tuple[JointAnswer, ...] = Field(description="base first")
    findings: tuple[FindingAnswer, ...] = Field(description="warnings first")

    @classmethod
    def of(cls, report: RobotReport) -> "RobotReportAnswer":
        return cls.model_validate(report)


def robot_part_rules(folder: Path) -> dict[str, PartRule]:
    return {
        "robot": PartRule(LARGEST_ROBOT_FILE, folder, default_name="robot.yaml"),
        "urdf": PartRule(LARGEST_XML, folder),
    }


def keep_inline_robot(folder: Path, robot: Mapping[str, Any]) -> str:
    """Write a robot that came as JSON. Raises RobotFileError if it is not plain data, or too large."""
    text = to_json_text(robot, "robot", RobotFileError)
    (folder / INLINE_NAME).write_text(text, encoding="utf-8")
    return INLINE_NAME
