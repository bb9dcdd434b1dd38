"""The robot file, read: YAML and perhaps the URDF that it names, to a Robot."""

from dataclasses import replace
from pathlib import Path

from tauscope.errors import RobotFileError
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.document import RobotDocument
from tauscope.robot.document_origin import DocumentOrigin
from tauscope.robot.messages import one_line
from tauscope.robot.robot import Robot
from tauscope.robot.robot_building import build_robot
from tauscope.robot.urdf_xml import LARGEST_URDF
from tauscope.robot.yaml_text import read_yaml

LARGEST_ROBOT_FILE = 1024 * 1024


def read_robot(path: Path | str) -> Robot:
    """The robot that a robot file describes.

    Raises
    ------
    RobotFileError
        if the file or its URDF cannot be read or is not valid; one line naming file, line, place and joint
    """
    source = Path(path)
    document, origin = parse_robot_file(read_bounded(source, LARGEST_ROBOT_FILE), str(path))

    def beside(file: str) -> tuple[bytes, str, Path | None]:
        urdf = source.parent / file
        try:
            return read_bounded(urdf, LARGEST_URDF), str(urdf), urdf
        except RobotFileError as error:
            raise origin.error(("kinematics", "urdf", "file"), str(error)) from error

    robot = build_robot(document, origin, beside)
    return replace(robot, source=source)


def parse_robot_file(data: bytes, label: str) -> tuple[RobotDocument, DocumentOrigin]:
    """The validated document of a robot file's bytes, and where it came from.

    Raises
    ------
    RobotFileError
        if the bytes are not the YAML of a robot file
    """
    if len(data) > LARGEST_ROBOT_FILE:
        raise RobotFileError(one_line(f"{label}: the file is larger than {LARGEST_ROBOT_FILE // 1024} KiB"))
    text = decode_utf8(data, label)
    if text.lstrip().startswith("<"):
        hint = "kinematics: {urdf: {file: …, base: …, tip: …}}"
        raise RobotFileError(one_line(f"{label}: is XML; write a robot file (YAML) that names the URDF, {hint}"))
    content = read_yaml(text, label)
    origin = DocumentOrigin(label, content.data, content.lines)
    return origin.validated(RobotDocument), origin
