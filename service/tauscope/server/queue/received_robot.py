"""Robot files that strangers sent, as a reading process reads them: never leading out of their own folder."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from tauscope.errors import RobotFileError
from tauscope.robot import Robot, RobotReport, check_robot, read_robot
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.messages import shown
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.urdf_element import local_name
from tauscope.robot.xml_text import LARGEST_XML, is_xml, parse_xml
from tauscope.robot.yaml_text import read_yaml
from tauscope.server.queue.job_folder import without_folders

FOLDERS = frozenset({"assetdir", "meshdir", "texturedir"})  # attributes of an MJCF that name a folder
_MOST_BODIES = 1000
_MOST_CELLS = 2**24  # a texture of 4096 by 4096
INLINE_NAME = "robot.json"  # file name of a robot that came as JSON; YAML readers read JSON


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
