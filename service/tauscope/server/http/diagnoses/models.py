"""Requests and answers about diagnoses."""

from typing import Any, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from tauscope.server.http.identifications.models import Names
from tauscope.server.http.robots.models import EXAMPLE_ROBOT
from tauscope.server.http.tasks.answers import JobAnswer
from tauscope.server.http.tasks.submission import RobotRequest
from tauscope.server.models import AnswerModel
from tauscope.server.queue.task_job import OrderedRecording
from tauscope.tasks.diagnose import DiagnosisOptions


class DiagnosisRequest(RobotRequest):
    """What is to be diagnosed."""

    recordings: Names | None = Field(
        default=None,
        description="names of the recordings that are to be explained: files of this form, or on the server; null: all"
        " files sent as part `recordings`",
    )
    held_out: Names | None = Field(
        default=None,
        description="names of the recordings that confirm findings; null: all files sent as part `held_out`",
    )
    simulated: Names | None = Field(
        default=None,
        description="names of recordings made in your own simulator; null: all files sent as part `simulated`",
    )
    model: str | dict[str, Any] | None = Field(
        default=None,
        description="model to compare with, for `against` saved: a model document, or the identifier of a diagnosis"
        " that succeeded; in a form, the part `model` may hold the file instead",
    )
    options: DiagnosisOptions = Field(default=DiagnosisOptions(), description="how it is diagnosed")

    @model_validator(mode="after")
    def _check_once(self) -> Self:
        """A recording counts once."""
        for names in (self.recordings or [], self.held_out or [], self.simulated or []):
            twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
            if twice is not None:
                raise PydanticCustomError("twice", "{name} is listed twice; list it once", {"name": twice})
        return self


EXAMPLES: dict[str, tuple[str, Any]] = {
    "server": (
        "Recordings that lie on the server",
        {"robot": EXAMPLE_ROBOT, "recordings": ["monday.csv", "tuesday.csv"], "held_out": ["wednesday.mcap"]},
    ),
    "simulation": (
        "What your own simulation has wrong, and what it lacks",
        {
            "robot": EXAMPLE_ROBOT,
            "recordings": ["monday.csv"],
            "simulated": ["simulated.csv"],
            "options": {"against": "simulation"},
        },
    ),
    "saved": (
        "What has changed since an earlier diagnosis",
        {
            "robot": EXAMPLE_ROBOT,
            "recordings": ["friday.csv"],
            "model": "20261103T101502Z-1f2e3d4c",
            "options": {"against": "saved"},
        },
    ),
}


class DiagnosisLinksAnswer(AnswerModel):
    """Where to go on from a diagnosis."""

    self_: str = Field(alias="self", description="its state")
    events: str = Field(description="what happens to it, as server-sent events")
    result: str | None = Field(default=None, description="its result, once it succeeded")
    plots: str | None = Field(default=None, description="data of its figures, once it succeeded")
    report: str | None = Field(default=None, description="its report as a page, once it succeeded")
    model: str | None = Field(default=None, description="the model with all findings, once it succeeded")
    scenario: str | None = Field(default=None, description="its findings for the simulated arm, once it succeeded")
    improved_robot: str | None = Field(
        default=None, description="the robot file with what was identified, once it succeeded"
    )
    exports: dict[str, str] = Field(default={}, description="its compensation code by format, once it succeeded")
    next_trajectory: str | None = Field(default=None, description="the motion to record next, where one was planned")


class DiagnosisAnswer(JobAnswer):
    """The state of a diagnosis."""

    robot: str | None = Field(default=None, description="name of the robot")
    recordings: tuple[OrderedRecording, ...] = Field(default=(), description="what is explained")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what findings are confirmed by")
    simulated: tuple[OrderedRecording, ...] = Field(default=(), description="what the user's simulator recorded")
    options: DiagnosisOptions | None = Field(default=None, description="how it is diagnosed")
    refused_exports: dict[str, str] = Field(
        default={}, description="formats that cannot hold this model, each with the reason"
    )
    links: DiagnosisLinksAnswer = Field(description="where to go on")


class DiagnosisListAnswer(AnswerModel):
    """Diagnoses that are kept."""

    diagnoses: list[DiagnosisAnswer] = Field(description="the newest first")
