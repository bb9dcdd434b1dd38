"""Rollout: how far the simulated arm strays from the real one under the same commands."""

from dataclasses import dataclass
from functools import partial

from pydantic import Field

from tauscope.closed_loop import Rollout, RolloutDocument, roll_out
from tauscope.export.model_file import read_export_models
from tauscope.robot import read_robot
from tauscope.tasks import task


class Request(task.TaskRequest):
    """What is to be rolled out, by the names of its files."""

    recordings: tuple[str, ...] = Field(description="recordings with commands, or with torque")
    refine: tuple[str, ...] = Field(default=(), description="recordings by which the model is refined")
    model: str | None = Field(default=None, description="model that identify or diagnose saved")
    options: task.ReadingOptions = Field(default=task.ReadingOptions(), description="how the recordings are read")


@dataclass(frozen=True, eq=False)
class Result(task.TaskResult):
    """What came of it."""

    rollout: Rollout
    document: RolloutDocument

    @property
    def outputs(self) -> task.Outputs:
        """``result.json`` and ``report.html``."""
        return task.Outputs({"result.json": partial(task.json_text, self.document), "report.html": self._report})

    def _report(self) -> str:
        from tauscope.closed_loop.page import rollout_page

        return rollout_page(self.rollout, self.provenance)


def perform(request: Request, files: task.Files, progress: task.Progress) -> Result:
    """Read the files and simulate. Raises TauscopeError where the data, the robot or the model cannot answer."""
    progress("read robot and recordings")
    robot = read_robot(files.find("robot", request.robot))
    exports = () if request.model is None else read_export_models(files.find("model", request.model))
    recordings = task.read_recordings(files, "recordings", request.recordings, robot, request.options)
    training = task.read_recordings(files, "refine", request.refine, robot, request.options)
    found = roll_out(robot, recordings, exports, progress, training)
    return Result(request, files, found.robot, recordings, found, found.document)
