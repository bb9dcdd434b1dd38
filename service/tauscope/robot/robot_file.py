"""Read a robot file, or a file with the layout of recordings."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from shutil import which
from subprocess import SubprocessError, run
from typing import Any

from tauscope.errors import RobotFileError
from tauscope.remote_files import find_path
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.document import DocumentOrigin, RecordingDocument, RobotDocument
from tauscope.robot.document_fields import LONGEST_NAME
from tauscope.robot.recording_layout import PRESETS, RecordingLayout
from tauscope.robot.robot import Robot
from tauscope.robot.robot_building import SourceFile, build_robot
from tauscope.robot.urdf_element import EXPAND, local_name
from tauscope.robot.xml_text import LARGEST_XML, is_xml, parse_xml
from tauscope.robot.yaml_text import Place, read_yaml

LARGEST_ROBOT_FILE = 1024 * 1024
XACRO_TIMEOUT_S = 60.0

KINEMATICS_OF_ROOT = {"robot": "urdf", "mujoco": "mjcf"}  # kinds of kinematics by the root element of a file


def read_robot(path: Path | str, *, expands_xacro: bool = True) -> Robot:
    """The robot of a robot file, or a URDF or MJCF by itself. Raises RobotFileError: file, line, place, joint.

    `expands_xacro`: whether the command ``xacro`` may read it, which opens any file: never for strangers' files.
    """
    source = find_path(path)
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

    try:
        robot = build_robot(document, origin, beside)
    except RobotFileError as error:
        if not expands_xacro or EXPAND not in str(error) or which("xacro") is None:
            raise
        robot = build_robot(document, origin, lambda kind, file: _expand(beside(kind, file)))
    return replace(robot, source=source)


def _expand(file: SourceFile) -> SourceFile:
    """A xacro as the installed command expands it."""
    try:
        words = ["xacro", str(file.path and file.path.absolute())]
        done = run(words, capture_output=True, timeout=XACRO_TIMEOUT_S, check=True)  # noqa: S603 — a fixed program
    except SubprocessError as error:
        said = getattr(error, "stderr", None) or str(error).encode()
        reason = said.decode(errors="replace").strip().partition("\n")[0]
        raise RobotFileError(f"{file.label}: xacro cannot expand the file ({reason})") from error
    return replace(file, data=done.stdout)


def parse_robot_file(data: bytes, label: str) -> tuple[RobotDocument, DocumentOrigin]:
    """Document and source of a robot file's bytes. Raises RobotFileError where they are none, nor URDF or MJCF."""
    if is_xml(data):
        origin = DocumentOrigin(label, describe_bare_file(data, label))
        return origin.validate(RobotDocument), origin
    if len(data) > LARGEST_ROBOT_FILE:
        raise RobotFileError(f"{label}: the file is larger than {LARGEST_ROBOT_FILE // 1024} KiB")
    content = read_yaml(decode_utf8(data, label), label)
    origin = DocumentOrigin(label, content.data, content.lines)
    return origin.validate(RobotDocument), origin


def describe_bare_file(data: bytes, label: str) -> dict[str, Any]:
    """The robot file of a URDF or MJCF by itself. Raises RobotFileError where it is neither."""
    root = parse_xml(data, label, [])
    kind, file = KINEMATICS_OF_ROOT.get(local_name(root)), Path(label).name
    if kind is None:
        way_out = "give a URDF (<robot>), an MJCF (<mujoco>) or a robot file"
        if local_name(root) == "sdf":
            way_out = "give the URDF or xacro that it was made from, or an MJCF: pip install sdformat-mjcf; sdf2mjcf"
        raise RobotFileError(f"{label}:{root.sourceline}: its root element is <{local_name(root)}>; {way_out}")
    stated = root.get("name") or root.get("model") or ""
    is_name = bool(stated.strip()) and stated.isprintable() and len(stated) <= LONGEST_NAME
    return {"name": stated if is_name else Path(label).stem, "kinematics": {kind: {"file": file}}}


LARGEST_LAYOUT_FILE = 64 * 1024
INLINE = "{"  # first sign of a mapping that stands in place of a file's name


def read_layout(text: str) -> RecordingLayout:
    """The layout that a preset, a file or YAML in flow style names. Raises RobotFileError where it is none of them."""
    if text in PRESETS:
        return RecordingLayout(columns=text)
    if text.startswith(INLINE):
        return parse_layout(text, "columns")
    path = Path(text)
    if not path.exists():
        presets = ", ".join(PRESETS)
        raise RobotFileError(f"{text}: neither a preset ({presets}) nor a file; check the name")
    return parse_layout(decode_utf8(read_bounded(path, LARGEST_LAYOUT_FILE), text), text)


def parse_layout(text: str, label: str) -> RecordingLayout:
    """The layout of YAML text. Raises RobotFileError where it is not valid; the message names line and key."""
    content = read_yaml(text, label)
    return layout_from_dict(content.data, label, content.lines)


def layout_from_dict(data: Any, label: str = "columns", lines: Mapping[Place, int] | None = None) -> RecordingLayout:
    """The layout of a block ``recording``, within a mapping or not, or of its columns. Raises RobotFileError."""
    lines = lines or {}
    if not isinstance(data, Mapping):
        raise RobotFileError(f"{label}: must be a mapping, as {{t: time, q: 'position_{{1}}', …}}")
    if set(data) == {"recording"}:
        data, lines = data["recording"], {place[1:]: line for place, line in lines.items() if place}
    elif not set(data) & set(RecordingDocument.model_fields):
        data, lines = {"columns": data}, {("columns", *place): line for place, line in lines.items()}
    return DocumentOrigin(label, data, lines).validate(RecordingDocument).layout
