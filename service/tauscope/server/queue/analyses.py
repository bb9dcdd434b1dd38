"""Jobs of the queue: what each kind of order and folder holds, and the work."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from tauscope.errors import LimitExceededError, NotFoundError
from tauscope.export.formats import CODE_FILES, EXPORT_FILES
from tauscope.robot import read_robot
from tauscope.server.queue.task_job import TRAJECTORY, OrderedRecording, TaskOrder, TaskWorkspace
from tauscope.server.store.files import read_bytes
from tauscope.tasks import design_excitation, diagnose, identify, rollout
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.identify import IdentificationOptions
from tauscope.tasks.task import ReadingOptions
from tauscope.trajectory import parse_trajectory_json
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


MOST_ROWS = 2_000_000  # rows of the longest CSV that is made on request


class ExcitationOrder(TaskOrder):
    task = design_excitation

    form: Literal["tauscope.excitation-order/1"] = "tauscope.excitation-order/1"
    options: ExcitationDesignOptions = Field(default=ExcitationDesignOptions(), description="how the motion is made")


class ExcitationWorkspace(TaskWorkspace[ExcitationOrder]):
    order_type = ExcitationOrder
    noun = "excitation"
    outputs: ClassVar[Mapping[str, str | None]] = {TRAJECTORY: None, "result.json": "tauscope.excitation/1"}


TASKS: Mapping[str, type[TaskWorkspace[Any]]] = {
    kind.noun: kind for kind in (IdentificationWorkspace, DiagnosisWorkspace, ExcitationWorkspace, RolloutWorkspace)
}
HEAVY = ("diagnosis", "rollout")  # their work takes minutes


def write_trajectory_piece(workspace: TaskWorkspace[Any], rate_hz: float, start: int) -> bytes:
    """CSV rows at `rate_hz` [Hz]; empty beyond the last. Raises NotFoundError, ExcitationError, LimitExceededError."""
    content, order = read_bytes(workspace.trajectory), workspace.read_order()
    if content is None or order is None:
        raise NotFoundError("files of the excitation are missing or damaged; hand it in again")
    trajectory = parse_trajectory_json(content, "trajectory.json", read_robot(workspace.robot / order.robot_file))
    rows = trajectory.duration_s * rate_hz
    if rows > MOST_ROWS:
        hint = "ask for a lower rate, or for the document"
        raise LimitExceededError(f"{rows:.3g} rows are more than the {MOST_ROWS} that are made here; {hint}")
    is_over = start >= trajectory.count_samples(rate_hz)
    return b"" if is_over else write_trajectory_rows(trajectory, rate_hz, start).encode()
