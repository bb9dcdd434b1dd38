"""Robot files that a request brings: kept in a folder of their own, never leading out of it; what is said of them."""

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import Field

from tauscope.errors import RobotFileError
from tauscope.robot import JointType, Robot, RobotReport, Severity, check_robot, read_robot
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.messages import shown
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.urdf_element import local_name
from tauscope.robot.xml_text import LARGEST_XML, is_xml, parse_xml
from tauscope.robot.yaml_text import read_yaml
from tauscope.server.http.answers import AnswerModel
from tauscope.server.http.bodies import PartRule, to_json_text
from tauscope.server.queue.job_folder import without_folders
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


FOLDERS = frozenset({"assetdir", "meshdir", "texturedir"})  # attributes of an MJCF that name a folder
_MOST_BODIES = 1000
_MOST_CELLS = 2**24  # a texture of 4096 by 4096
INLINE_NAME = "robot.json"  # file name of a robot that came as JSON; YAML readers read JSON


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


def read_received_robot(folder: Path, file_name: str) -> Robot:
    """Raises RobotFileError if it is not valid, or names a file that was not sent with it."""
    try:
        _confine_files(folder, file_name)
        return read_robot(folder / file_name, expands_xacro=False)
    except RobotFileError as error:
        raise type(error)(_word_for_user(str(error), folder)) from None


def check_received_robot(folder: Path, file_name: str) -> RobotReport:
    """Raises RobotFileError if it cannot be read at all, or names a file that was not sent with it."""
    try:
        _confine_files(folder, file_name)
        report = check_robot(folder / file_name, expands_xacro=False)
    except RobotFileError as error:
        raise type(error)(_word_for_user(str(error), folder)) from None
    findings = (replace(finding, where=_word_for_user(finding.where, folder)) for finding in report.findings)
    return replace(report, source=file_name, findings=tuple(findings))


def _confine_files(folder: Path, file_name: str) -> None:
    """Refuse a robot file that names a file that did not come with it: no path of the server is opened for a client."""
    data = read_bounded(folder / file_name, LARGEST_ROBOT_FILE)
    if is_xml(data):
        _confine_xml(data, file_name)
        return
    sent = {entry.name for entry in folder.iterdir()} - {file_name}
    content = read_yaml(decode_utf8(data, file_name), file_name).data
    kinematics = content.get("kinematics") if isinstance(content, dict) else None
    for kind in ("urdf", "mjcf"):
        named = kinematics.get(kind) if isinstance(kinematics, dict) else None
        file = named.get("file") if isinstance(named, dict) else None
        if not isinstance(file, str):
            continue
        if file not in sent:
            hint = "send that file as part urdf, and write its bare name into the robot file"
            raise RobotFileError(f"{file_name}: kinematics.{kind}.file: {shown(file)} was not sent; {hint}")
        _confine_xml(read_bounded(folder / file, LARGEST_XML), file)


def _confine_xml(data: bytes, label: str) -> None:
    """Refuse an MJCF that names other files, folders or plugins: MuJoCo would open them."""
    root = parse_xml(data, label, [])
    if local_name(root) != "mujoco":
        return
    for element in root.iter():
        kind = local_name(element)
        names = [name for name in element.attrib if name.startswith("file") or name in FOLDERS]
        if names or kind in ("extension", "plugin"):
            hint = "send one MJCF without included files and meshes: MuJoCo saves it so (mj_saveLastXML)"
            raise RobotFileError(f"{label}:{element.sourceline}: <{kind}> names a file that was not sent; {hint}")
    _require_modest(root, label)


def _require_modest(root: Any, label: str) -> None:
    """Refuse an MJCF that has MuJoCo generate far more than it says. Raises RobotFileError naming the element."""
    bodies = float(sum(local_name(element) == "body" for element in root.iter()))
    for element in root.iter():
        sizes = [_multiply(element.get(name, "")) for name in ("width", "height", "nrow", "ncol")]
        bodies *= _multiply(element.get("count", ""))
        if bodies > _MOST_BODIES or math.prod(sizes) > _MOST_CELLS:
            text = f"<{local_name(element)}> generates more than {_MOST_BODIES} bodies or {_MOST_CELLS} cells"
            raise RobotFileError(f"{label}:{element.sourceline}: {text}; leave it out: no joint needs it")


def _multiply(text: str) -> float:
    """The product of the numbers of an attribute; 1 where it has none."""
    try:
        return math.prod(max(1.0, float(word)) for word in text.split())
    except ValueError:
        return 1.0  # MuJoCo says better what is wrong


def _word_for_user(text: str, folder: Path) -> str:
    """A message without the server's folder; an inline robot has no file and no lines."""
    return without_folders(text, folder).replace(f"{INLINE_NAME}:1: ", "robot: ").replace(f"{INLINE_NAME}: ", "robot: ")
