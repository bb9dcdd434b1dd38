"""Rollout jobs: what is ordered, what their folder holds, and the work."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from tauscope.server.queue.record import JobProblem
from tauscope.server.queue.task_job import SAVED_MODEL, OrderedRecording, TaskOrder, TaskWorkspace, perform_job
from tauscope.tasks import rollout
from tauscope.tasks.task import ReadingOptions


class RolloutOrder(TaskOrder):
    """Input of a rollout job."""

    form: Literal["tauscope.rollout-order/1"] = Field(
        default="tauscope.rollout-order/1", description="name and version of this form"
    )
    recordings: tuple[OrderedRecording, ...] = Field(description="what is rolled out")
    refine: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is refined by")
    model: str | None = Field(default=None, description="name of the model, in the folder `against`")
    options: ReadingOptions = Field(default=ReadingOptions(), description="how the recordings are read")

    @property
    def request(self) -> rollout.Request:
        """The request of the task."""
        return rollout.Request(
            robot=self.robot_file,
            recordings=tuple(entry.name for entry in self.recordings),
            refine=tuple(entry.name for entry in self.refine),
            model=self.model,
            options=self.options,
        )


class RolloutWorkspace(TaskWorkspace[RolloutOrder]):
    """Files of a rollout job."""

    order_type = RolloutOrder
    noun = "rollout"
    roles = ("recordings", "refine")
    outputs: ClassVar[Mapping[str, str | None]] = {"report.html": None, "result.json": "tauscope.rollout/1"}

    def prepare(self) -> None:
        """Make the folders that hold a job's input."""
        super().prepare()
        self.uploads(SAVED_MODEL).mkdir()


def run_rollout(folder: Path, server_recordings: Path) -> JobProblem | None:
    """Do a rollout job; returns why there is no result."""
    return perform_job(rollout, RolloutWorkspace(folder), server_recordings)
