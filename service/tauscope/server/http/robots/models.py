"""Requests and answers about robots."""

from typing import Any

from pydantic import Field

from tauscope.robot import JointType, RobotReport, Severity
from tauscope.server.models import AnswerModel
from tauscope.strict_model import StrictModel

EXAMPLE_ROBOT: dict[str, Any] = {
    "name": "two-joint-arm",
    "kinematics": {
        "dh": [
            {"theta": 0.0, "d": 0.3, "a": 0.0, "alpha": 1.5707963267948966},
            {"theta": 0.0, "d": 0.0, "a": 0.5, "alpha": 0.0},
        ]
    },
    "joints": [
        {"name": "joint1", "limits": {"position": [-2.9, 2.9], "velocity": 2.0}},
        {"name": "joint2", "limits": {"position": [-2.9, 2.9], "velocity": 2.0}},
    ],
    "model": {
        "links": [
            {
                "mass": 2.0,
                "first_moment": [0.0, 0.0, 0.0],
                "inertia": {"xx": 0.02, "yy": 0.02, "zz": 0.02, "xy": 0.0, "xz": 0.0, "yz": 0.0},
            },
            {
                "mass": 1.0,
                "first_moment": [-0.25, 0.0, 0.0],
                "inertia": {"xx": 0.01, "yy": 0.09, "zz": 0.09, "xy": 0.0, "xz": 0.0, "yz": 0.0},
            },
        ]
    },
}


class RobotCheckRequest(StrictModel):
    """A robot to be checked."""

    robot: dict[str, Any] = Field(description="content of a robot file", examples=[EXAMPLE_ROBOT])


class LimitsAnswer(AnswerModel):
    """What a joint may do; null where nothing is stated."""

    position: tuple[float, float] | None = Field(description="lowest and highest position [rad or m]")
    velocity: float | None = Field(description="largest speed [rad/s or m/s]")
    acceleration: float | None = Field(description="largest acceleration [rad/s² or m/s²]")
    torque: float | None = Field(description="largest torque [Nm] or force [N]")


class JointAnswer(AnswerModel):
    """One joint."""

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
    before: tuple[float, ...] = Field(
        description="4 × 4 transform, row by row: link frame = frame before · before · motion about (along) z · after"
    )
    after: tuple[float, ...] = Field(description="4 × 4 transform, row by row, from the joint to the link frame [m]")


class FindingAnswer(AnswerModel):
    """One remark."""

    severity: Severity = Field(description="warning: may spoil results; info: good to know")
    where: str = Field(description="file and place, or column, that it is about")
    text: str = Field(description="what is so, and what to do about it")


class RobotReportAnswer(AnswerModel):
    """A robot file at a glance."""

    name: str = Field(description="of the robot")
    gravity: tuple[float, float, float] = Field(description="in the base frame [m/s²]")
    total_mass: float | None = Field(description="of all moving links, as the model believes [kg]")
    joints: tuple[JointAnswer, ...] = Field(description="base first")
    findings: tuple[FindingAnswer, ...] = Field(description="warnings first")

    @classmethod
    def of(cls, report: RobotReport) -> "RobotReportAnswer":
        """The answer that holds a report."""
        return cls.model_validate(report)
