"""The robot file, read: YAML and perhaps the URDF or MJCF that it names, or such a file by itself, to a Robot."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from tauscope.errors import RobotFileError
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.document import RobotDocument
from tauscope.robot.document_fields import LONGEST_NAME
from tauscope.robot.document_origin import DocumentOrigin
from tauscope.robot.messages import one_line
from tauscope.robot.robot import Robot
from tauscope.robot.robot_building import SourceFile, build_robot
from tauscope.robot.urdf_element import local_name
from tauscope.robot.xml_text import LARGEST_XML, is_xml, parse_xml
from tauscope.robot.yaml_text import read_yaml

LARGEST_ROBOT_FILE = 1024 * 1024

KINEMATICS_OF_ROOT = {"robot": "urdf", "mujoco": "mjcf"}  # kinds of kinematics by the root element of a file


def read_robot(path: Path | str) -> Robot:
    """The robot that a robot file describes, or a URDF or MJCF by itself.

    Raises RobotFileError if the file or the one that it names cannot be read or is not valid; one line naming file,
    line, place and joint.
    """
    source = Path(path)
    data = read_bounded(source, LARGEST_XML)
    document, origin = parse_robot_file(data, str(path))

    def beside(kind: str, file: str) -> SourceFile:
        named = source.parent / file
        if is_xml(data):  # the file names itself
            return SourceFile(data, str(path), source)
        try:
            return SourceFile(read_bounded(named, LARGEST_XML), str(named), named)
        except RobotFileError as error:
            raise origin.error(("kinematics", kind, "file"), str(error)) from error

    robot = build_robot(document, origin, beside)
    return replace(robot, source=source)


def parse_robot_file(data: bytes, label: str) -> tuple[RobotDocument, DocumentOrigin]:
    """The validated document of a robot file's bytes, and where it came from.

    Raises RobotFileError if the bytes are not the YAML of a robot file, nor a URDF or MJCF.
    """
    if is_xml(data):
        origin = DocumentOrigin(label, describe_bare_file(data, label))
        return origin.validated(RobotDocument), origin
    if len(data) > LARGEST_ROBOT_FILE:
        raise RobotFileError(one_line(f"{label}: the file is larger than {LARGEST_ROBOT_FILE // 1024} KiB"))
    content = read_yaml(decode_utf8(data, label), label)
    origin = DocumentOrigin(label, content.data, content.lines)
    return origin.validated(RobotDocument), origin


def describe_bare_file(data: bytes, label: str) -> dict[str, Any]:
    """The robot file that says the same as a URDF or MJCF by itself: base and tip by default.

    Raises RobotFileError if the file is neither.
    """
    root = parse_xml(data, label, [])
    kind, file = KINEMATICS_OF_ROOT.get(local_name(root)), Path(label).name
    if kind is None:
        text = f"its root element is <{local_name(root)}>; give a URDF (<robot>), an MJCF (<mujoco>) or a robot file"
        raise RobotFileError(one_line(f"{label}:{root.sourceline}: {text}"))
    stated = root.get("name") or root.get("model") or ""
    is_name = bool(stated.strip()) and stated.isprintable() and len(stated) <= LONGEST_NAME
    return {"name": stated if is_name else Path(label).stem, "kinematics": {kind: {"file": file}}}
