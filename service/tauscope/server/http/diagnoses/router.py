"""Routes about diagnoses."""

from pathlib import Path

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.plots import DiagnosisPlots
from tauscope.diagnosis.extended_model.saved import ModelDocument
from tauscope.errors import NotFoundError
from tauscope.server.http.diagnoses.models import EXAMPLES, DiagnosisAnswer, DiagnosisListAnswer, DiagnosisRequest
from tauscope.server.http.diagnoses.status import describe, find_diagnosis, finished_diagnosis
from tauscope.server.http.diagnoses.submission import submit_diagnosis
from tauscope.server.http.jobs.collection import add_collection_routes
from tauscope.server.http.jobs.documents import HTML, HTML_CONTENT, JobDocument, add_document_routes
from tauscope.server.http.jobs.events import add_events_route
from tauscope.server.http.jobs.routes import SUBMISSION
from tauscope.server.http.jobs.submission import request_body
from tauscope.server.http.robots.of_job import add_robot_route
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.problems import problem_responses
from tauscope.server.queue.diagnosis_workspace import DiagnosisWorkspace
from tauscope.trajectory.document import TrajectoryDocument

router = APIRouter(prefix="/diagnoses", tags=["diagnoses"], responses=problem_responses("invalid-request"))

_FILES = {"type": "array", "items": {"type": "string", "contentMediaType": "application/octet-stream"}}
_UPLOADS = {
    "recordings": {**_FILES, "description": "recordings that are to be explained"},
    "held_out": {**_FILES, "description": "recordings that findings are confirmed by"},
    "simulated": {**_FILES, "description": "recordings made in your own simulator"},
}


@router.post(
    "",
    status_code=202,
    summary="Hand in a diagnosis",
    response_model=DiagnosisAnswer,
    responses=problem_responses(*SUBMISSION, "recording", "not-found", "queue-full"),
    openapi_extra=request_body(DiagnosisRequest, EXAMPLES, _UPLOADS),
)
async def hand_in(request: Request, response: Response, services: ServicesDep) -> DiagnosisAnswer:
    """The robot is checked at once, recordings are read by the job: follow `Location` until it has ended."""
    identifier = await submit_diagnosis(request, services)
    answer = await run_in_threadpool(describe, services, identifier, request.url.path)
    response.headers["Location"] = answer.links.self_
    return answer


def _planned_motion(workspace: DiagnosisWorkspace) -> bytes:
    """The trajectory of a diagnosis that planned one."""
    content = workspace.read_trajectory()
    if content is None:
        raise NotFoundError("no motion was planned: nothing is open; ask for one with options.next_trajectory")
    return content


_DOCUMENTS = (
    JobDocument(
        "result",
        DiagnosisWorkspace.read_result,
        "Fetch the result",
        "The result of a diagnosis that succeeded; else the problem that it ended in.",
        {"model": DiagnosisDocument, "description": "the same document as `tauscope diagnose --json`"},
    ),
    JobDocument(
        "plots",
        DiagnosisWorkspace.read_plots,
        "Fetch the data of its figures",
        "What figures of the diagnosis are drawn from.",
        {"model": DiagnosisPlots, "description": "residuals over time and by variable, before and after"},
    ),
    JobDocument(
        "report",
        DiagnosisWorkspace.read_report,
        "Fetch the report",
        "The report as one page: no script, no request to anywhere, ready to print.",
        {
            "content": HTML_CONTENT,
            "description": "the same page as `tauscope diagnose --report`",
        },
        HTML,
    ),
    JobDocument(
        "model",
        DiagnosisWorkspace.read_model,
        "Fetch the model with all findings",
        "The extended model.",
        {"model": ModelDocument, "description": "the same document as `tauscope diagnose --model`"},
    ),
    JobDocument(
        "next-trajectory",
        _planned_motion,
        "Fetch the motion to record next",
        "The motion that best separates, or shows, what is open; a problem where none was planned.",
        {"model": TrajectoryDocument, "description": "a trajectory that `tauscope run` plays"},
    ),
)

add_collection_routes(
    router, "a diagnosis", lambda services: services.diagnoses, (DiagnosisAnswer, DiagnosisListAnswer), describe
)
add_document_routes(
    router,
    finished_diagnosis,
    _DOCUMENTS,
    "robot-file",
    "recording",
    "recording-mismatch",
    "identification",
    "excitation",
    "invalid-request",
)
add_events_route(router, "a diagnosis", find_diagnosis)


def _robot(services: Services, identifier: str) -> tuple[Path, str | None]:
    """Where the robot of a diagnosis lies."""
    workspace = find_diagnosis(services, identifier)
    order = workspace.read_order()
    return workspace.robot, None if order is None else order.robot_file


add_robot_route(router, "a diagnosis", _robot)
