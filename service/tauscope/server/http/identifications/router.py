"""Routes about identifications."""

from pathlib import Path as FilePath
from typing import Annotated, Any

from fastapi import APIRouter, Path, Request, Response
from starlette.concurrency import run_in_threadpool

from tauscope.errors import ExportError, NotFoundError
from tauscope.export.formats import EXPORT_FILES, ExportFormat
from tauscope.identification import IdentificationDocument
from tauscope.report.identification_plots import IdentificationPlots
from tauscope.robot.messages import nearest, one_line, shown
from tauscope.server.http.identifications.models import (
    EXAMPLES,
    IdentificationAnswer,
    IdentificationListAnswer,
    IdentificationRequest,
)
from tauscope.server.http.identifications.status import describe, find_identification, finished_identification
from tauscope.server.http.identifications.submission import submit_identification
from tauscope.server.http.jobs.collection import add_collection_routes
from tauscope.server.http.jobs.documents import HTML, HTML_CONTENT, JobDocument, add_document_routes
from tauscope.server.http.jobs.events import add_events_route
from tauscope.server.http.jobs.routes import ENDINGS, SUBMISSION, Identifier
from tauscope.server.http.jobs.submission import request_body
from tauscope.server.http.robots.of_job import add_robot_route
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.problems import problem_responses
from tauscope.server.queue.identification_workspace import IdentificationWorkspace

router = APIRouter(prefix="/identifications", tags=["identifications"], responses=problem_responses("invalid-request"))

Format = Annotated[
    str, Path(alias="format", description="what to write", json_schema_extra={"enum": [*ExportFormat]}, examples=["c"])
]

_FILES = {"type": "array", "items": {"type": "string", "contentMediaType": "application/octet-stream"}}
_UPLOADS = {
    "recordings": {**_FILES, "description": "recordings that the model is made from"},
    "held_out": {**_FILES, "description": "recordings that it is judged by"},
}
_EXPORT_CONTENT: dict[str, Any] = {
    media_type: {"schema": {"type": "string"}}
    for media_type in sorted({file.media_type for file in EXPORT_FILES.values()})
}


@router.post(
    "",
    status_code=202,
    summary="Hand in an identification",
    response_model=IdentificationAnswer,
    responses=problem_responses(*SUBMISSION, "recording", "not-found", "queue-full"),
    openapi_extra=request_body(IdentificationRequest, EXAMPLES, _UPLOADS),
)
async def hand_in(request: Request, response: Response, services: ServicesDep) -> IdentificationAnswer:
    """The robot is checked at once, recordings are read by the job: follow `Location` until it has ended."""
    identifier = await submit_identification(request, services)
    answer = await run_in_threadpool(describe, services, identifier, request.url.path)
    response.headers["Location"] = answer.links.self_
    return answer


_DOCUMENTS = (
    JobDocument(
        "result",
        IdentificationWorkspace.read_result,
        "Fetch the result",
        "The result of an identification that succeeded; else the problem that it ended in.",
        {"model": IdentificationDocument, "description": "the same document as `tauscope identify --json`"},
    ),
    JobDocument(
        "plots",
        IdentificationWorkspace.read_plots,
        "Fetch the data of its figures",
        "What figures of the identification are drawn from.",
        {"model": IdentificationPlots, "description": "torque over time and friction over velocity, joint by joint"},
    ),
    JobDocument(
        "report",
        IdentificationWorkspace.read_report,
        "Fetch the report",
        "The report as one page: no script, no request to anywhere, ready to print.",
        {
            "content": HTML_CONTENT,
            "description": "the same page as `tauscope identify --report`",
        },
        HTML,
    ),
)

add_collection_routes(
    router,
    "an identification",
    lambda services: services.identifications,
    (IdentificationAnswer, IdentificationListAnswer),
    describe,
)
add_document_routes(
    router,
    finished_identification,
    _DOCUMENTS,
    "robot-file",
    "recording",
    "recording-mismatch",
    "identification",
    "invalid-request",
)


@router.get(
    "/{identifier}/exports/{format}",
    summary="Fetch an export",
    response_class=Response,
    responses={
        200: {"content": _EXPORT_CONTENT, "description": "the file"},
        **problem_responses("not-found", *ENDINGS, "export", "recording", "identification", "worker-lost", "internal"),
    },
)
def get_export(identifier: Identifier, format_: Format, services: ServicesDep) -> Response:
    """The identified model for a controller (json, yaml, c, python) or a simulator (urdf, mjcf)."""
    if format_ not in set(ExportFormat):
        raise NotFoundError(one_line(f"there is no export {shown(format_)}; {nearest(format_, set(ExportFormat))}"))
    workspace = finished_identification(services, identifier)
    reason = workspace.refused_exports().get(format_)
    if reason is not None:
        raise ExportError(reason)
    file = EXPORT_FILES[ExportFormat(format_)]
    disposition = {"Content-Disposition": f'attachment; filename="{file.name}"'}
    return Response(workspace.read_export(file.name), headers=disposition, media_type=file.media_type)


add_events_route(router, "an identification", find_identification)


def _robot(services: Services, identifier: str) -> tuple[FilePath, str | None]:
    """Where the robot of an identification lies."""
    workspace = find_identification(services, identifier)
    order = workspace.read_order()
    return workspace.robot, None if order is None else order.robot_file


add_robot_route(router, "an identification", _robot)
