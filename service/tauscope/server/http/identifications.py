"""Identifications: requests, answers and what is special about this resource."""

from collections.abc import Sequence
from typing import Annotated, Any, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from tauscope.export.model_file import ModelFile
from tauscope.identification import IdentificationDocument
from tauscope.report.identification_plots import IdentificationPlots
from tauscope.server.http.openapi import binary_parts
from tauscope.server.http.robots.models import EXAMPLE_ROBOT
from tauscope.server.http.saved_models import MODEL_FILE
from tauscope.server.http.tasks.answers import JobAnswer
from tauscope.server.http.tasks.queued import QueuedTask
from tauscope.server.http.tasks.router import HTML, JobDocument, text_document
from tauscope.server.http.tasks.submission import RobotRequest
from tauscope.server.models import AnswerModel, PageAnswer
from tauscope.server.queue.identification import IdentificationWorkspace
from tauscope.server.queue.task_job import OrderedRecording
from tauscope.server.store.files import FILE_NAME_PATTERN, FILE_NAME_RULE, is_file_name
from tauscope.tasks.identify import IdentificationOptions


def _file_name(value: str) -> str:
    """A name that could belong to a recording."""
    if not is_file_name(value):
        raise PydanticCustomError("file_name", "is no name of a recording; {rule}", {"rule": FILE_NAME_RULE})
    return value


FileName = Annotated[str, AfterValidator(_file_name), Field(json_schema_extra={"pattern": FILE_NAME_PATTERN})]
Names = Annotated[list[FileName], Field(max_length=1000)]


def require_listed_once(*lists: Sequence[str] | None) -> None:
    """Refuse a name that stands twice in one of the lists.

    Raises
    ------
    PydanticCustomError
        naming it
    """
    for names in filter(None, lists):
        twice = next((name for index, name in enumerate(names) if name in names[:index]), None)
        if twice is not None:
            raise PydanticCustomError("twice", "{name} is listed twice; list it once", {"name": twice})


class IdentificationRequest(RobotRequest):
    """What is to be identified."""

    recordings: Names | None = Field(
        default=None,
        description="names of the recordings that the model is made from: files of this form, or on the server;"
        " null: all files sent as part `recordings`",
    )
    held_out: Names | None = Field(
        default=None,
        description="names of the recordings that it is judged by; null: all files sent as part `held_out`",
    )
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")

    @model_validator(mode="after")
    def _check_once(self) -> Self:
        """A recording counts once."""
        require_listed_once(self.recordings, self.held_out)
        return self


EXAMPLES: dict[str, tuple[str, Any]] = {
    "server": (
        "Recordings that lie on the server",
        {"robot": EXAMPLE_ROBOT, "recordings": ["monday.csv", "tuesday.csv"], "held_out": ["wednesday.mcap"]},
    ),
    "options": (
        "Ordinary least squares without a filter",
        {
            "robot": EXAMPLE_ROBOT,
            "recordings": ["monday.csv"],
            "options": {"estimator": "ls", "cutoff_hz": None, "rotor_inertia": False},
        },
    ),
}


class LinksAnswer(AnswerModel):
    """Where to go on from an identification."""

    self_: str = Field(alias="self", description="its state")
    events: str = Field(description="what happens to it, as server-sent events")
    result: str | None = Field(default=None, description="its result, once it succeeded")
    plots: str | None = Field(default=None, description="data of its figures, once it succeeded")
    report: str | None = Field(default=None, description="its report as a page, once it succeeded")
    model: str | None = Field(default=None, description="the identified model, once it succeeded")
    exports: dict[str, str] = Field(default={}, description="its exports by format, once it succeeded")


class IdentificationAnswer(JobAnswer):
    """The state of an identification."""

    robot: str | None = Field(default=None, description="name of the robot")
    recordings: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is made from")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what it is judged by")
    options: IdentificationOptions | None = Field(default=None, description="how it is identified")
    refused_exports: dict[str, str] = Field(
        default={}, description="formats that cannot hold this model, each with the reason"
    )
    links: LinksAnswer = Field(description="where to go on")


class IdentificationListAnswer(PageAnswer):
    """Identifications that are kept."""

    identifications: list[IdentificationAnswer] = Field(description="the newest first")


IDENTIFICATIONS = QueuedTask(
    noun="an identification",
    plural="identifications",
    kind=lambda services: services.identifications,
    workspace=IdentificationWorkspace,
    models=(IdentificationRequest, IdentificationAnswer, IdentificationListAnswer),
    examples=EXAMPLES,
    summary="Hand in an identification",
    words="The robot is checked at once, recordings are read by the job: follow `Location` until it has ended.",
    parts={
        "recordings": binary_parts("recordings that the model is made from"),
        "held_out": binary_parts("recordings that it is judged by"),
    },
    work_problems=("robot-file", "recording", "recording-mismatch", "identification", "invalid-request"),
    documents=(
        JobDocument(
            "result",
            "result.json",
            "Fetch the result",
            "The result of an identification that succeeded; else the problem that it ended in.",
            {"model": IdentificationDocument, "description": "the same document as `tauscope identify --json`"},
        ),
        JobDocument(
            "plots",
            "plots.json",
            "Fetch the data of its figures",
            "What figures of the identification are drawn from.",
            {
                "model": IdentificationPlots,
                "description": "torque over time and friction over velocity, joint by joint",
            },
        ),
        JobDocument(
            "model",
            MODEL_FILE,
            "Fetch the model",
            "The identified model, for a rollout.",
            {"model": ModelFile, "description": "the same document as `tauscope identify --model`"},
            missing="an earlier version identified this and kept no model; hand it in again",
        ),
        text_document(
            "report",
            "report.html",
            HTML,
            "Fetch the report",
            "The report as one page: no script, no request to anywhere, ready to print.",
            "page as `tauscope identify --report`",
        ),
    ),
    export_words="The identified model for a controller (json, yaml, c, python) or a simulator (urdf, mjcf).",
)

router = IDENTIFICATIONS.router()
