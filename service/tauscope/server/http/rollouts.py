"""Rollouts: requests, answers and what is special about this resource."""

from typing import Any

from pydantic import Field

from tauscope.closed_loop import RolloutDocument
from tauscope.diagnosis.extended_model import LARGEST_FILE
from tauscope.errors import NotFoundError
from tauscope.server.http.answers import JobAnswer, JobLinks, require_document
from tauscope.server.http.diagnoses import DIAGNOSES
from tauscope.server.http.identifications import IDENTIFICATIONS
from tauscope.server.http.openapi import binary_part, binary_parts
from tauscope.server.http.robot_files import EXAMPLE_ROBOT
from tauscope.server.http.services import Services
from tauscope.server.http.tasks.queued import QueuedTask
from tauscope.server.http.tasks.router import report_document, result_document
from tauscope.server.http.tasks.submission import MODEL_FILE, Names, Received, RecordingsRequest, keep_model
from tauscope.server.queue.analyses import RolloutWorkspace
from tauscope.server.queue.task_job import SAVED_MODEL, OrderedRecording
from tauscope.tasks.task import ReadingOptions


class RolloutRequest(RecordingsRequest):
    """What is to be rolled out."""

    recordings: Names | None = Field(
        default=None,
        description="names of recordings with commands, or with torque: files of this form, or on the server; null: all"
        " files sent as part `recordings`",
    )
    refine: Names | None = Field(
        default=None,
        description="names of recordings with commands by which the model is refined; null: all files sent as part"
        " `refine`",
    )
    model: str | dict[str, Any] | None = Field(
        default=None,
        description="model to roll out without and with its findings: a model document, or the identifier of an"
        " identification or a diagnosis that succeeded; in a form, the part `model` may hold the file instead",
    )
    options: ReadingOptions = Field(default=ReadingOptions(), description="how the recordings are read")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "identified": (
        "A recording on the server, and the model of an identification",
        {"robot": EXAMPLE_ROBOT, "recordings": ["wednesday.mcap"], "model": "20261103T101502Z-1f2e3d4c"},
    )
}


class RolloutLinksAnswer(JobLinks):
    report: str | None = Field(default=None, description="its report as a page, once it succeeded")


class RolloutAnswer(JobAnswer):
    recordings: tuple[OrderedRecording, ...] = Field(default=(), description="what is rolled out")
    refine: tuple[OrderedRecording, ...] = Field(default=(), description="what the model is refined by")
    options: ReadingOptions | None = Field(default=None, description="how the recordings are read")
    links: RolloutLinksAnswer = Field(description="where to go on")


def place_model(received: Received[RolloutRequest], services: Services, workspace: Any) -> dict[str, str | None]:
    """Put the model into its place. Raises ProblemError if it came twice, NotFoundError if it is unknown."""

    def read(identifier: str) -> bytes:
        try:
            found = IDENTIFICATIONS.finished(services, identifier)
        except NotFoundError:
            found = DIAGNOSES.finished(services, identifier)
        return require_document(found.read_output(MODEL_FILE), identifier)

    return {"model": keep_model(received.document.model, received.form.file("model"), workspace, read)}


ROLLOUTS = QueuedTask(
    noun="a rollout",
    plural="rollouts",
    kind=lambda services: services.rollouts,
    workspace=RolloutWorkspace,
    models=(RolloutRequest, RolloutAnswer),
    examples=EXAMPLES,
    summary="Hand in a rollout",
    words="The robot is checked at once, MuJoCo gets the commands of the recordings in the job: follow `Location` until"
    " it has ended.",
    parts={
        "recordings": binary_parts("recordings with commands, or with torque"),
        "refine": binary_parts("recordings with commands by which the model is refined"),
        "model": binary_part("a model that identify or diagnose saved"),
    },
    further=place_model,
    further_parts={"model": (SAVED_MODEL, LARGEST_FILE)},
    work_problems=("robot-file", "recording", "recording-mismatch", "identification", "export", "invalid-request"),
    documents=(result_document("a rollout", "rollout", RolloutDocument), report_document("rollout")),
)

router = ROLLOUTS.router()
