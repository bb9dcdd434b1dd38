"""Jobs that analyse recordings: what is ordered, what their folder holds, and the work."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from tauscope.export.formats import CODE_FILES, EXPORT_FILES
from tauscope.server.queue.record import JobProblem
from tauscope.server.queue.task_job import (
    TRAJECTORY,
    OrderedRecording,
    TaskOrder,
    TaskWorkspace,
    perform_job,
)
from tauscope.tasks import diagnose, identify, rollout
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.identify import IdentificationOptions
from tauscope.tasks.task import ReadingOptions


class IdentificationOrder(TaskOrder):
    """Input of an identification job."""

    task = identify

    form: Literal["tauscope.order/1"] = Field(default="tauscope.order/1", description="name and version of this form")
    recordings: tuple[OrderedRecording, ...] = Field(description="what the model is made from")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what it is judged by")
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")


class IdentificationWorkspace(TaskWorkspace[IdentificationOrder]):
    """Files of an identification job."""

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
    """Do an identification job; returns why there is no result."""
    return perform_job(IdentificationWorkspace(folder), server_recordings)


class DiagnosisOrder(TaskOrder):
    """Input of a diagnosis job."""

    task = diagnose

    form: Literal["tauscope.diagnosis-order/1"] = Field(
        default="tauscope.diagnosis-order/1", description="name and version of this form"
    )
    recordings: tuple[OrderedRecording, ...] = Field(description="what is to be explained")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what findings are confirmed by")
    simulated: tuple[OrderedRecording, ...] = Field(default=(), description="what the user's simulator recorded")
    model: str | None = Field(default=None, description="name of the model to compare with, in the folder `against`")
    options: DiagnosisOptions = Field(default=DiagnosisOptions(), description="how it is diagnosed")


class DiagnosisWorkspace(TaskWorkspace[DiagnosisOrder]):
    """Files of a diagnosis job."""

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
    """Do a diagnosis job; returns why there is no result."""
    return perform_job(DiagnosisWorkspace(folder), server_recordings)


class RolloutOrder(TaskOrder):
    """Input of a rollout job."""

    task = rollout

    form: Literal["tauscope.rollout-order/1"] = Field(
        default="tauscope.rollout-order/1", description="name and version of this form"
    )
    recordings: tuple[OrderedRecording, ...] = Field(description="what is rolled out")
    refine: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is refined by")
    model: str | None = Field(default=None, description="name of the model, in the folder `against`")
    options: ReadingOptions = Field(default=ReadingOptions(), description="how the recordings are read")


class RolloutWorkspace(TaskWorkspace[RolloutOrder]):
    """Files of a rollout job."""

    order_type = RolloutOrder
    noun = "rollout"
    roles = ("recordings", "refine")
    takes_model = True
    outputs: ClassVar[Mapping[str, str | None]] = {"report.html": None, "result.json": "tauscope.rollout/1"}


def run_rollout(folder: Path, server_recordings: Path) -> JobProblem | None:
    """Do a rollout job; returns why there is no result."""
    return perform_job(RolloutWorkspace(folder), server_recordings)
