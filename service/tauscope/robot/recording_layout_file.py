"""A recording's layout from a file of its own, or from one line: the ``recording`` block of a robot file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tauscope.errors import RobotFileError
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.document import RecordingDocument
from tauscope.robot.document_origin import DocumentOrigin
from tauscope.robot.messages import one_line
from tauscope.robot.recording_layout import PRESETS, RecordingLayout
from tauscope.robot.yaml_text import Place, read_yaml

LARGEST_LAYOUT_FILE = 64 * 1024
INLINE = "{"  # first sign of a mapping that stands in place of a file's name


def read_layout(text: str) -> RecordingLayout:
    """The layout that a preset, a file or a mapping in YAML's flow style names.

    A file holds the block, with or without the key ``recording``, or the columns alone. Raises RobotFileError where it
    is neither a preset nor a file, or not valid.
    """
    if text in PRESETS:
        return RecordingLayout(columns=text)
    if text.startswith(INLINE):
        return parse_layout(text, "columns")
    path = Path(text)
    if not path.exists():
        presets = ", ".join(PRESETS)
        raise RobotFileError(one_line(f"{text}: neither a preset ({presets}) nor a file; check the name"))
    return parse_layout(decode_utf8(read_bounded(path, LARGEST_LAYOUT_FILE), text), text)


def parse_layout(text: str, label: str) -> RecordingLayout:
    """The layout of YAML text. Raises RobotFileError where it is not valid; the message names line and key."""
    content = read_yaml(text, label)
    return layout_from_dict(content.data, label, content.lines)


def layout_from_dict(data: Any, label: str = "columns", lines: Mapping[Place, int] | None = None) -> RecordingLayout:
    """The layout of plain data: the block ``recording``, that block in a mapping, or its columns alone.

    Raises RobotFileError where it is not valid.
    """
    lines = lines or {}
    if not isinstance(data, Mapping):
        raise RobotFileError(one_line(f"{label}: must be a mapping, as {{t: time, q: 'position_{{1}}', …}}"))
    if set(data) == {"recording"}:
        data, lines = data["recording"], {place[1:]: line for place, line in lines.items() if place}
    elif not set(data) & set(RecordingDocument.model_fields):
        data, lines = {"columns": data}, {("columns", *place): line for place, line in lines.items()}
    return DocumentOrigin(label, data, lines).validated(RecordingDocument).layout
