"""Identification jobs: what is ordered, what their folder holds, and the work."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from tauscope.export.formats import EXPORT_FILES
from tauscope.server.queue.record import JobProblem
from tauscope.server.queue.task_job import OrderedRecording, TaskOrder, TaskWorkspace, perform_job
from tauscope.tasks import identify
from tauscope.tasks.identify import IdentificationOptions


class IdentificationOrder(TaskOrder):
    """Input of an identification job."""

    form: Literal["tauscope.order/1"] = Field(default="tauscope.order/1", description="name and version of this form")
    recordings: tuple[OrderedRecording, ...] = Field(description="what the model is made from")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what it is judged by")
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")

    @property
    def request(self) -> identify.Request:
        """The request of the task."""
        return identify.Request(
            robot=self.robot_file,
            recordings=tuple(entry.name for entry in self.recordings),
            held_out=tuple(entry.name for entry in self.held_out),
            options=self.options,
        )


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
    return perform_job(identify, IdentificationWorkspace(folder), server_recordings)
