"""Trajectory files: JSON with exact coefficients, or CSV with samples, by their suffix."""

from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError

from tauscope.errors import ExcitationError, RobotFileError, explain_os_errors
from tauscope.robot import Robot
from tauscope.robot.bounded_file import decode_utf8, read_bounded
from tauscope.robot.messages import shown
from tauscope.trajectory import document as documents
from tauscope.trajectory.csv_format import parse_trajectory_csv, trajectory_csv
from tauscope.trajectory.trajectory import Trajectory

LARGEST_FILE = 256 * 2**20  # bytes of the largest trajectory file that is read
DEFAULT_RATE_HZ = 500.0  # rate of CSV samples where none is asked for [Hz]


def read_trajectory(path: str | Path, robot: Robot) -> Trajectory:
    """Read JSON (``.json``) or else CSV. Raises ExcitationError, which names file and key, or line and column."""
    path = Path(path)
    try:
        text = decode_utf8(read_bounded(path, LARGEST_FILE), str(path))
    except RobotFileError as error:  # the same reader, another kind of file
        raise ExcitationError(str(error)) from None
    if path.suffix.lower() == ".json":
        return parse_trajectory_json(text, str(path), robot)
    return parse_trajectory_csv(text, str(path), robot.name, tuple(joint.name for joint in robot.joints))


def parse_trajectory_json(text: str | bytes, name: str, robot: Robot) -> Trajectory:
    """The trajectory of a JSON document. Raises ExcitationError naming the key."""
    try:
        document = _document(text)
    except ValidationError as error:
        raise ExcitationError(f"{name}: {_first_fault(error)}") from None

    if len(document.joints) != robot.joint_count:
        raise ExcitationError(
            f"{name}: joints: the trajectory moves {len(document.joints)} joints, robot {robot.name!r} has "
            f"{robot.joint_count}; take one that was made for it"
        )
    try:
        return documents.trajectory_of(document)
    except ExcitationError as error:
        raise ExcitationError(f"{name}: {error}") from None


def trajectory_json(trajectory: Trajectory) -> str:
    """A trajectory as a JSON document, schema ``tauscope.trajectory/1``."""
    return documents.trajectory_document(trajectory).model_dump_json(by_alias=True, indent=1) + "\n"


def write_trajectory(trajectory: Trajectory, path: str | Path, *, rate_hz: float = DEFAULT_RATE_HZ) -> None:
    """Write JSON or CSV. Raises ExcitationError for another suffix, or where it cannot be written."""
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (".json", ".csv"):
        raise ExcitationError(f"{path}: a trajectory file ends in .json or .csv; rename it")
    text = trajectory_json(trajectory) if suffix == ".json" else trajectory_csv(trajectory, rate_hz)
    with explain_os_errors(ExcitationError, f"{path}: cannot be written", "; choose another place"):
        path.write_text(text, encoding="utf-8")


def _document(text: str | bytes) -> documents.TrajectoryDocument:
    """The trajectory's document, by itself or within an excitation's."""
    if _Schema.model_validate_json(text).schema_ == documents.EXCITATION_SCHEMA:
        return documents.ExcitationDocument.model_validate_json(text).trajectory
    return documents.TrajectoryDocument.model_validate_json(text)


class _Schema(BaseModel):
    """Which kind of document it is; a trajectory's where it says nothing that we know."""

    schema_: Any = Field(default=None, alias="schema")


def _first_fault(error: ValidationError) -> str:
    """The first fault as ``segments[2].cosine[0]: what is wrong``."""
    fault = error.errors(include_url=False, include_context=False)[0]
    kinds = ("fourier", "path", "move", "sampled")
    key = ""
    for part in fault["loc"]:
        if isinstance(part, int):
            key += f"[{part}]"
        elif part not in kinds:  # pydantic also names the chosen kind of segment
            key += f".{part}" if key else str(part)
    message = fault["msg"][:1].lower() + fault["msg"][1:]
    value = fault.get("input")
    hint = "" if fault["type"] in ("missing", "json_invalid") else f" (it is {shown(value)})"
    return f"{key or 'the document'}: {message}{hint}"
