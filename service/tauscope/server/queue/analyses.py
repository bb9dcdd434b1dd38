"""Jobs of the queue: what each kind of order and folder holds, the work, and recordings as a worker reads them."""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tauscope.errors import LimitExceededError, NotFoundError, RecordingError
from tauscope.export.formats import CODE_FILES, EXPORT_FILES
from tauscope.recording import ColumnMapping, Reading, RecordingReport, check_recording, find_mapping, read_recording
from tauscope.recording.recording import Array
from tauscope.report.series import envelope_indices
from tauscope.robot import Robot, read_robot
from tauscope.server.queue.job_folder import JobProblem, hide_folders, without_folders
from tauscope.server.queue.task_job import TRAJECTORY, OrderedRecording, TaskOrder, TaskWorkspace, perform_job
from tauscope.tasks import design_excitation, diagnose, identify, rollout
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.identify import IdentificationOptions
from tauscope.tasks.task import ReadingOptions
from tauscope.trajectory import parse_trajectory_json, read_trajectory
from tauscope.trajectory.csv_format import write_trajectory_rows


class IdentificationOrder(TaskOrder):
    task = identify

    form: Literal["tauscope.order/1"] = Field(default="tauscope.order/1", description="name and version of this form")
    recordings: tuple[OrderedRecording, ...] = Field(description="what the model is made from")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what it is judged by")
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")


class IdentificationWorkspace(TaskWorkspace[IdentificationOrder]):
    order_type = IdentificationOrder
    noun = "identification"
    roles = ("recordings", "held_out")
    outputs: ClassVar[Mapping[str, str | None]] = {
        "model.json": "tauscope.model/1",
        "plots.json": "tauscope.identification-plots/1",
        "report.html": None,
        "result.json": "tauscope.identification/1",
    }
    formats = EXPORT_FILES


def run_identification(folder: Path, server_recordings: Path) -> JobProblem | None:
    return perform_job(IdentificationWorkspace(folder), server_recordings)


class DiagnosisOrder(TaskOrder):
    task = diagnose

    form: Literal["tauscope.diagnosis-order/1"] = "tauscope.diagnosis-order/1"
    recordings: tuple[OrderedRecording, ...] = Field(description="what is to be explained")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what findings are confirmed by")
    simulated: tuple[OrderedRecording, ...] = Field(default=(), description="what the user's simulator recorded")
    model: str | None = Field(default=None, description="name of the model to compare with, in the folder `against`")
    options: DiagnosisOptions = Field(default=DiagnosisOptions(), description="how it is diagnosed")


class DiagnosisWorkspace(TaskWorkspace[DiagnosisOrder]):
    order_type = DiagnosisOrder
    noun = "diagnosis"
    roles = ("recordings", "held_out", "simulated")
    takes_model = True
    outputs: ClassVar[Mapping[str, str | None]] = {
        TRAJECTORY: "tauscope.trajectory/1",
        "plots.json": "tauscope.diagnosis-plots/1",
        "model.json": "tauscope.model/1",
        "scenario.yaml": None,
        "improved-robot.yaml": None,
        "report.html": None,
        "result.json": "tauscope.diagnosis/1",
    }
    formats = CODE_FILES


def run_diagnosis(folder: Path, server_recordings: Path) -> JobProblem | None:
    return perform_job(DiagnosisWorkspace(folder), server_recordings)


class RolloutOrder(TaskOrder):
    task = rollout

    form: Literal["tauscope.rollout-order/1"] = "tauscope.rollout-order/1"
    recordings: tuple[OrderedRecording, ...] = Field(description="what is rolled out")
    refine: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is refined by")
    model: str | None = Field(default=None, description="name of the model, in the folder `against`")
    options: ReadingOptions = Field(default=ReadingOptions(), description="how the recordings are read")


class RolloutWorkspace(TaskWorkspace[RolloutOrder]):
    order_type = RolloutOrder
    noun = "rollout"
    roles = ("recordings", "refine")
    takes_model = True
    outputs: ClassVar[Mapping[str, str | None]] = {"report.html": None, "result.json": "tauscope.rollout/1"}


def run_rollout(folder: Path, server_recordings: Path) -> JobProblem | None:
    return perform_job(RolloutWorkspace(folder), server_recordings)


MOST_ROWS = 2_000_000  # rows of the longest CSV that is made on request


class ExcitationOrder(TaskOrder):
    task = design_excitation

    form: Literal["tauscope.excitation-order/1"] = "tauscope.excitation-order/1"
    options: ExcitationDesignOptions = Field(default=ExcitationDesignOptions(), description="how the motion is made")


class ExcitationWorkspace(TaskWorkspace[ExcitationOrder]):
    order_type = ExcitationOrder
    noun = "excitation"
    outputs: ClassVar[Mapping[str, str | None]] = {TRAJECTORY: None, "result.json": "tauscope.excitation/1"}


def run_excitation(folder: Path) -> JobProblem | None:
    return perform_job(ExcitationWorkspace(folder), folder)


def write_trajectory_piece(workspace: TaskWorkspace[Any], rate_hz: float, start: int) -> bytes:
    """CSV rows at `rate_hz` [Hz]; empty beyond the last. Raises NotFoundError, ExcitationError, LimitExceededError."""
    try:
        content, order = workspace.trajectory.read_bytes(), workspace.read_order()
    except OSError:
        order = None
    if order is None:
        raise NotFoundError("files of the excitation are missing or damaged; hand it in again")
    trajectory = parse_trajectory_json(content, "trajectory.json", read_robot(workspace.robot / order.robot_file))
    rows = trajectory.duration_s * rate_hz
    if rows > MOST_ROWS:
        hint = "ask for a lower rate, or for the document"
        raise LimitExceededError(f"{rows:.3g} rows are more than the {MOST_ROWS} that are made here; {hint}")
    is_over = start >= trajectory.count_samples(rate_hz)
    return b"" if is_over else write_trajectory_rows(trajectory, rate_hz, start).encode()


def check_trajectory(folder: Path, robot_file: Path) -> None:
    """Read a trajectory as a worker does. Raises ExcitationError if it is not valid, or not for this arm."""
    (path,) = folder.iterdir()
    with hide_folders(folder, robot_file.parent):
        read_trajectory(path, read_robot(robot_file))


def check_kept_recording(path: Path, joint_count: int | None) -> RecordingReport:
    """Report on a recording. Raises RecordingError, whose message calls the file by its name alone."""
    with hide_folders(path.parent):
        return replace(check_recording(path, joint_count), name=path.name)


@dataclass(frozen=True)
class Understanding:
    """`mapping`: None for a log, which names its joints; `problem`: why the file is refused, without `report`."""

    mapping: ColumnMapping | None
    report: RecordingReport | None
    problem: str | None


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
    if len(values) <= most:
        return np.arange(len(values))
    share = max(most // values.shape[1], 2)
    return np.unique(np.concatenate([envelope_indices(column, share) for column in values.T]))
