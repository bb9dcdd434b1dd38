"""Routes about excitations."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.excitations.models import EXAMPLES, ExcitationAnswer, ExcitationListAnswer, ExcitationRequest
from tauscope.server.http.excitations.status import describe, find_excitation, finished_excitation
from tauscope.server.http.excitations.submission import submit_excitation
from tauscope.server.http.jobs.answers import require_document
from tauscope.server.http.jobs.collection import add_collection_routes
from tauscope.server.http.jobs.documents import JobDocument, add_document_routes
from tauscope.server.http.jobs.events import add_events_route
from tauscope.server.http.jobs.routes import ENDINGS, SUBMISSION, Identifier
from tauscope.server.http.jobs.submission import request_body
from tauscope.server.http.services import ServicesDep
from tauscope.server.problems import problem_responses
from tauscope.server.queue.excitation_work import read_designed_trajectory
from tauscope.server.queue.excitation_workspace import ExcitationWorkspace

router = APIRouter(prefix="/excitations", tags=["excitations"], responses=problem_responses("invalid-request"))

TrajectoryFormat = Annotated[
    Literal["json", "csv"],
    Query(alias="format", description="json: exact coefficients; csv: samples that any controller can play"),
]
Rate = Annotated[float, Query(gt=0.0, le=10_000.0, description="samples a second of the CSV [Hz]")]


@router.post(
    "",
    status_code=202,
    summary="Have a motion designed",
    response_model=ExcitationAnswer,
    responses=problem_responses(*SUBMISSION, "queue-full"),
    openapi_extra=request_body(ExcitationRequest, EXAMPLES),
)
async def hand_in(request: Request, response: Response, services: ServicesDep) -> ExcitationAnswer:
    """The robot is checked at once, the motion is designed by the job: follow `Location` until it has ended."""
    identifier = await submit_excitation(request, services)
    answer = await run_in_threadpool(describe, services, identifier, request.url.path)
    response.headers["Location"] = answer.links.self_
    return answer


_RESULT = JobDocument(
    "result",
    ExcitationWorkspace.read_result,
    "Fetch the design",
    "Criterion, its history, and what is left to every limit; else the problem that the job ended in.",
    {"content": {"application/json": {}}, "description": "the same document as `tauscope excite --json`"},
)

add_collection_routes(
    router, "an excitation", lambda services: services.excitations, (ExcitationAnswer, ExcitationListAnswer), describe
)
add_document_routes(router, finished_excitation, [_RESULT], "excitation", "robot-file")


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
    workspace = finished_excitation(services, identifier)
    content = read_designed_trajectory(workspace, None if format_ == "json" else rate_hz)
    media_type = "application/json" if format_ == "json" else "text/csv"
    disposition = {"Content-Disposition": f'attachment; filename="trajectory.{format_}"'}
    return Response(require_document(content, identifier), headers=disposition, media_type=media_type)


add_events_route(router, "an excitation", find_excitation)
