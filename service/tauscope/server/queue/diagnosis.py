"""Diagnosis jobs: what is ordered, what their folder holds, and the work."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from tauscope.export.formats import CODE_FILES
from tauscope.server.queue.record import JobProblem
from tauscope.server.queue.task_job import (
    SAVED_MODEL,
    TRAJECTORY,
    OrderedRecording,
    TaskOrder,
    TaskWorkspace,
    perform_job,
)
from tauscope.tasks import diagnose
from tauscope.tasks.diagnose import DiagnosisOptions


class DiagnosisOrder(TaskOrder):
    """Input of a diagnosis job."""

    form: Literal["tauscope.diagnosis-order/1"] = Field(
        default="tauscope.diagnosis-order/1", description="name and version of this form"
    )
    recordings: tuple[OrderedRecording, ...] = Field(description="what is to be explained")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what findings are confirmed by")
    simulated: tuple[OrderedRecording, ...] = Field(default=(), description="what the user's simulator recorded")
    model: str | None = Field(default=None, description="name of the model to compare with, in the folder `against`")
    options: DiagnosisOptions = Field(default=DiagnosisOptions(), description="how it is diagnosed")

    @property
    def request(self) -> diagnose.Request:
        """The request of the task."""
        return diagnose.Request(
            robot=self.robot_file,
            recordings=tuple(entry.name for entry in self.recordings),
            held_out=tuple(entry.name for entry in self.held_out),
            simulated=tuple(entry.name for entry in self.simulated),
            model=self.model,
            options=self.options,
        )


class DiagnosisWorkspace(TaskWorkspace[DiagnosisOrder]):
    """Files of a diagnosis job."""

    order_type = DiagnosisOrder
    noun = "diagnosis"
    roles = ("recordings", "held_out", "simulated")
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

    def prepare(self) -> None:
        """Make the folders that hold a job's input."""
        super().prepare()
        self.uploads(SAVED_MODEL).mkdir()


def run_diagnosis(folder: Path, server_recordings: Path) -> JobProblem | None:
    """Do a diagnosis job; returns why there is no result."""
    return perform_job(diagnose, DiagnosisWorkspace(folder), server_recordings)
