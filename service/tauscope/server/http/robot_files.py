"""Robot files that a request brings, kept in a folder of their own, and what is said of them."""

from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import Field

from tauscope.errors import RobotFileError
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.xml_text import LARGEST_XML
from tauscope.server.http.answers import AnswerModel
from tauscope.server.http.bodies import PartRule, to_json_text
from tauscope.server.queue.received_files import INLINE_NAME
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
