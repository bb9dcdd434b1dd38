"""Identifications: requests, answers and what is special about this resource."""

from typing import Any

from pydantic import Field

from tauscope.export.model_file import ModelFile
from tauscope.identification import IdentificationDocument
from tauscope.report.curves import IdentificationPlots
from tauscope.server.http.answers import JobAnswer, JobLinks
from tauscope.server.http.openapi import binary_parts
from tauscope.server.http.robot_files import EXAMPLE_ROBOT
from tauscope.server.http.tasks.queued import QueuedTask
from tauscope.server.http.tasks.router import JobDocument, plots_document, report_document, result_document
from tauscope.server.http.tasks.submission import MODEL_FILE, RECORDINGS_EXAMPLE, Names, RecordingsRequest
from tauscope.server.queue.analyses import IdentificationWorkspace
from tauscope.server.queue.task_job import OrderedRecording
from tauscope.tasks.identify import IdentificationOptions


class IdentificationRequest(RecordingsRequest):
    """What is to be identified."""

    recordings: Names | None = Field(
        default=None,
        description="names of the recordings that the model is made from: files of this form, or on the server;"
        " null: all files sent as part `recordings`",
    )
    held_out: Names | None = Field(default=None, description="recordings that judge it; null: every part `held_out`")
    options: IdentificationOptions = Field(default=IdentificationOptions(), description="how it is identified")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "server": RECORDINGS_EXAMPLE,
    "options": (
        "Ordinary least squares without a filter",
        {
            "robot": EXAMPLE_ROBOT,
            "recordings": ["monday.csv"],
            "options": {"estimator": "ls", "cutoff_hz": None, "rotor_inertia": False},
        },
    ),
}


class LinksAnswer(JobLinks):
    plots: str | None = Field(default=None, description="data of its figures, once it succeeded")
    report: str | None = Field(default=None, description="its report as a page, once it succeeded")
    model: str | None = Field(default=None, description="the identified model, once it succeeded")
    exports: dict[str, str] = Field(default={}, description="its exports by format, once it succeeded")


class IdentificationAnswer(JobAnswer):
    recordings: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is made from")
    held_out: tuple[OrderedRecording, ...] = Field(default=(), description="what it is judged by")
    options: IdentificationOptions | None = Field(default=None, description="how it is identified")
    refused_exports: dict[str, str] = Field(default={}, description="reason by format that cannot hold this model")
    links: LinksAnswer = Field(description="where to go on")


IDENTIFICATIONS = QueuedTask(
    noun="an identification",
    plural="identifications",
    kind=lambda services: services.identifications,
    workspace=IdentificationWorkspace,
    models=(IdentificationRequest, IdentificationAnswer),
    examples=EXAMPLES,
    summary="Hand in an identification",
    words="The robot is checked at once, recordings are read by the job: follow `Location` until it has ended.",
    parts={
        "recordings": binary_parts("recordings that the model is made from"),
        "held_out": binary_parts("recordings that it is judged by"),
    },
    work_problems=("robot-file", "recording", "recording-mismatch", "identification", "invalid-request"),
    documents=(
        result_document("an identification", "identify", IdentificationDocument),
        plots_document("the identification", IdentificationPlots, "torque over time, friction over velocity"),
        JobDocument(
            "model",
            MODEL_FILE,
            "Fetch the model",
            "The identified model, for a rollout.",
            {"model": ModelFile, "description": "the same document as `tauscope identify --model`"},
            missing="an earlier version identified this and kept no model; hand it in again",
        ),
        report_document("identify"),
    ),
    export_words="The identified model for a controller (json, yaml, c, python) or a simulator (urdf, mjcf).",
)

router = IDENTIFICATIONS.router()
