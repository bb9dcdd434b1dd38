"""Excitations: what is special about this resource."""

from typing import Annotated, Literal

from fastapi import Query, Response

from tauscope.server.http.excitations.models import EXAMPLES, ExcitationAnswer, ExcitationListAnswer, ExcitationRequest
from tauscope.server.http.services import ServicesDep
from tauscope.server.http.tasks.answers import require_document
from tauscope.server.http.tasks.queued import QueuedTask
from tauscope.server.http.tasks.router import JobDocument
from tauscope.server.http.tasks.routes import ENDINGS, Identifier
from tauscope.server.problems import problem_responses
from tauscope.server.queue.excitation import ExcitationWorkspace, read_designed_trajectory

TrajectoryFormat = Annotated[
    Literal["json", "csv"],
    Query(alias="format", description="json: exact coefficients; csv: samples that any controller can play"),
]
Rate = Annotated[float, Query(gt=0.0, le=10_000.0, description="samples a second of the CSV [Hz]")]

EXCITATIONS = QueuedTask(
    noun="an excitation",
    plural="excitations",
    kind=lambda services: services.excitations,
    workspace=ExcitationWorkspace,
    models=(ExcitationRequest, ExcitationAnswer, ExcitationListAnswer),
    examples=EXAMPLES,
    summary="Have a motion designed",
    words="The robot is checked at once, the motion is designed by the job: follow `Location` until it has ended.",
    submission_problems=("queue-full",),
    work_problems=("excitation", "robot-file"),
    documents=(
        JobDocument(
            "result",
            "result.json",
            "Fetch the design",
            "Criterion, its history, and what is left to every limit; else the problem that the job ended in.",
            {"content": {"application/json": {}}, "description": "the same document as `tauscope excite --json`"},
        ),
    ),
    links=("trajectory",),
)

router = EXCITATIONS.router()


@router.get(
    "/{identifier}/trajectory",
    summary="Fetch the trajectory",
    response_class=Response,
    responses={
        200: {"content": {"application/json": {}, "text/csv": {}}, "description": "the file"},
        **problem_responses("not-found", *ENDINGS, "excitation", "limit-exceeded", "worker-lost", "internal"),
    },
)
def get_trajectory(
    identifier: Identifier, services: ServicesDep, format_: TrajectoryFormat = "json", rate_hz: Rate = 500.0
) -> Response:
    """The motion for Tauscope itself (json) or for another controller (csv)."""
    workspace = EXCITATIONS.finished(services, identifier)
    content = read_designed_trajectory(workspace, None if format_ == "json" else rate_hz)
    media_type = "application/json" if format_ == "json" else "text/csv"
    disposition = {"Content-Disposition": f'attachment; filename="trajectory.{format_}"'}
    return Response(require_document(content, identifier), headers=disposition, media_type=media_type)
