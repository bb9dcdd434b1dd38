"""Routes about diagnoses."""

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from service.api.diagnoses.models import EXAMPLES, DiagnosisAnswer, DiagnosisListAnswer, DiagnosisRequest
from service.api.diagnoses.status import describe, find_diagnosis, finished_diagnosis
from service.api.diagnoses.submission import submit_diagnosis
from service.api.jobs.answers import require_document
from service.api.jobs.events import add_events_route
from service.api.jobs.removal import add_removal_route
from service.api.jobs.routes import ENDINGS, SUBMISSION, Identifier, Limit, collection
from service.api.jobs.submission import request_body
from service.api.problems import problem_responses
from service.api.services import Offered
from service.diagnosis import DiagnosisDocument
from service.diagnosis.extended_model import ModelDocument
from service.diagnosis.plots import DiagnosisPlots
from service.errors import NotFoundError
from service.excitation.trajectory_document import TrajectoryDocument

router = APIRouter(prefix="/diagnoses", tags=["diagnoses"], responses=problem_responses("invalid-request"))

_FILES = {"type": "array", "items": {"type": "string", "contentMediaType": "application/octet-stream"}}
_UPLOADS = {
    "recordings": {**_FILES, "description": "recordings that are to be explained"},
    "held_out": {**_FILES, "description": "recordings that findings are confirmed by"},
    "simulated": {**_FILES, "description": "recordings made in your own simulator"},
}
_PROBLEMS = (
    "not-found",
    *ENDINGS,
    "robot-file",
    "recording",
    "recording-mismatch",
    "identification",
    "excitation",
    "invalid-request",
    "worker-lost",
    "internal",
)


@router.post(
    "",
    status_code=202,
    summary="Hand in a diagnosis",
    response_model=DiagnosisAnswer,
    responses=problem_responses(*SUBMISSION, "not-found", "queue-full"),
    openapi_extra=request_body(DiagnosisRequest, EXAMPLES, _UPLOADS),
)
async def hand_in(request: Request, response: Response, services: Offered) -> DiagnosisAnswer:
    """The robot is checked at once, recordings are read by the job: follow `Location` until it has ended."""
    identifier = await submit_diagnosis(request, services)
    answer = await run_in_threadpool(describe, services, identifier, request.url.path)
    response.headers["Location"] = answer.links.self_
    return answer


@router.get("", summary="List diagnoses")
def list_diagnoses(request: Request, services: Offered, limit: Limit = 100) -> DiagnosisListAnswer:
    """The newest first."""
    identifiers = services.diagnoses.items.identifiers()[:limit]
    return DiagnosisListAnswer(diagnoses=[describe(services, each, request.url.path) for each in identifiers])


@router.get("/{identifier}", summary="Follow a diagnosis", responses=problem_responses("not-found"))
def get_diagnosis(request: Request, identifier: Identifier, services: Offered) -> DiagnosisAnswer:
    """Its state, and where to go on from there."""
    return describe(services, identifier, collection(request, 1))


@router.get(
    "/{identifier}/result",
    summary="Fetch the result",
    response_class=Response,
    responses={
        200: {"model": DiagnosisDocument, "description": "the same document as `tauscope diagnose --json`"},
        **problem_responses(*_PROBLEMS),
    },
)
def get_result(identifier: Identifier, services: Offered) -> Response:
    """The result of a diagnosis that succeeded; else the problem that it ended in."""
    return _json(finished_diagnosis(services, identifier).read_result(), identifier)


@router.get(
    "/{identifier}/plots",
    summary="Fetch the data of its figures",
    response_class=Response,
    responses={
        200: {"model": DiagnosisPlots, "description": "residuals over time and by variable, before and after"},
        **problem_responses(*_PROBLEMS),
    },
)
def get_plots(identifier: Identifier, services: Offered) -> Response:
    """What figures of the diagnosis are drawn from."""
    return _json(finished_diagnosis(services, identifier).read_plots(), identifier)


@router.get(
    "/{identifier}/model",
    summary="Fetch the model with all findings",
    response_class=Response,
    responses={
        200: {"model": ModelDocument, "description": "the same document as `tauscope diagnose --model`"},
        **problem_responses(*_PROBLEMS),
    },
)
def get_model(identifier: Identifier, services: Offered) -> Response:
    """The extended model."""
    return _json(finished_diagnosis(services, identifier).read_model(), identifier)


@router.get(
    "/{identifier}/next-trajectory",
    summary="Fetch the motion to record next",
    response_class=Response,
    responses={
        200: {"model": TrajectoryDocument, "description": "a trajectory that `tauscope run` plays"},
        **problem_responses(*_PROBLEMS),
    },
)
def get_next_trajectory(identifier: Identifier, services: Offered) -> Response:
    """The motion that best separates, or shows, what is open; a problem where none was planned."""
    content = finished_diagnosis(services, identifier).read_trajectory()
    if content is None:
        raise NotFoundError("no motion was planned: nothing is open; ask for one with options.next_trajectory")
    return Response(content, media_type="application/json")


def _json(content: bytes | None, identifier: str) -> Response:
    return Response(require_document(content, identifier), media_type="application/json")


add_removal_route(router, "a diagnosis", lambda services: services.diagnoses, DiagnosisAnswer, describe)
add_events_route(router, "a diagnosis", find_diagnosis)
