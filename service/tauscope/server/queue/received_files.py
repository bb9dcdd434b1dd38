"""Files that strangers sent, as a reading process reads them: named by bare names, never leading elsewhere."""

import json
import math
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tauscope.errors import RecordingError, RobotFileError
from tauscope.recording import ColumnMapping, Reading, RecordingReport, check_recording, find_mapping, read_recording
from tauscope.recording.recording import Array
from tauscope.robot import Robot, RobotReport, check_robot, read_robot
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.messages import shown
from tauscope.robot.robot_file import LARGEST_ROBOT_FILE
from tauscope.robot.urdf_element import local_name
from tauscope.robot.xml_text import LARGEST_XML, is_xml, parse_xml
from tauscope.robot.yaml_text import read_yaml
from tauscope.server.queue.job_folder import hide_folders, without_folders
from tauscope.strict_model import entry
from tauscope.trajectory import read_trajectory

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
    return replace(report, findings=tuple(findings))


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


def check_trajectory(folder: Path, robot_file: Path) -> None:
    """Read a trajectory as a worker does. Raises ExcitationError if it is not valid, or not for this arm."""
    (path,) = folder.iterdir()
    with hide_folders(folder, robot_file.parent):
        read_trajectory(path, read_robot(robot_file))


def check_kept_recording(path: Path, joint_count: int | None) -> RecordingReport:
    """Report on a recording. Raises RecordingError, whose message calls the file by its name alone."""
    with hide_folders(path.parent):
        return replace(check_recording(path, joint_count), name=path.name)


@entry
class Understanding:
    """How a recording is understood; nothing of it is kept."""

    mapping: ColumnMapping | None = Field(description="its columns and units; null for a log, which names its joints")
    report: RecordingReport | None = Field(description="what it holds, read so; null where it is refused")
    problem: str | None = Field(description="why it is refused, and what to do")


def understand_recording(path: Path, robot: Robot | None, reading: Reading) -> Understanding:
    """Find columns and units, guessed ones too, and report what a file holds when it is read so."""
    mapping = None
    with suppress(RecordingError):  # a log, or a file that the check refuses, too
        mapping = find_mapping(path, robot, reading)
    if mapping is not None and mapping.is_guessed and reading.columns is None:
        reading = replace(reading, columns=mapping.columns, units={**mapping.units, **reading.units})
    try:
        report = check_recording(path, None, robot, reading)
    except RecordingError as error:
        return Understanding(mapping, None, without_folders(str(error), path.parent))
    return Understanding(mapping, replace(report, name=path.name), None)


def read_kept_samples(path: Path, most: int) -> bytes:
    """Samples of a plot, thinned to extremes: header length (4 bytes), JSON header, columns of 32-bit floats."""
    with hide_folders(path.parent):
        recording = read_recording(path)
    samples = recording.samples()
    effort = recording.effort_kind.value
    values = np.hstack([samples.position, samples.effort])
    kept = _choose_rows(values, most)
    joints = range(1, recording.joint_count + 1)
    header = {
        "columns": ["t", *(f"q{j}" for j in joints), *(f"{effort}{j}" for j in joints)],
        "joint_count": recording.joint_count,
        "effort": effort,
        "samples": len(samples.time),
        "shown": len(kept),
    }
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    columns = np.vstack([samples.time[kept] - samples.time[0], values[kept].T]).astype("<f4")
    return len(text).to_bytes(4, "little") + text + columns.tobytes()


def _choose_rows(values: Array, most: int) -> NDArray[np.intp]:
    from tauscope.report.curves import envelope_indices  # loads all of an identification, for plots only

    if len(values) <= most:
        return np.arange(len(values))
    share = max(most // values.shape[1], 2)
    return np.unique(np.concatenate([envelope_indices(column, share) for column in values.T]))
