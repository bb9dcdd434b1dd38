"""Routes about robots."""

import shutil
import tempfile
from pathlib import Path

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.documents import JSON, media_type, read_document, refuse_media_type
from tauscope.server.http.form import FORM, receive_form
from tauscope.server.http.openapi import binary_part, form_body, json_body
from tauscope.server.http.reading import READING
from tauscope.server.http.robots.files import check_received_robot, keep_inline_robot, robot_part_rules
from tauscope.server.http.robots.models import EXAMPLE_ROBOT, RobotCheckRequest, RobotReportAnswer
from tauscope.server.http.services import ServicesDep
from tauscope.server.problems import ProblemError, problem_responses

router = APIRouter(prefix="/robots", tags=["robots"])

_BODY = {
    **json_body(RobotCheckRequest, {"inline": ("A robot as JSON", {"robot": EXAMPLE_ROBOT})}),
    **form_body(
        {
            "robot": binary_part("the robot file (YAML)"),
            "urdf": binary_part("the URDF that the robot file names, by its bare name"),
        },
        required=["robot"],
    ),
}


@router.post(
    "/check",
    summary="Check a robot file",
    response_model=RobotReportAnswer,
    responses=problem_responses("bad-request", "media-type", "robot-file", "invalid-request", *READING),
    openapi_extra={"requestBody": {"required": True, "content": _BODY}},
)
async def check_robot_file(request: Request, services: ServicesDep) -> RobotReportAnswer:
    """Summary and findings; nothing is kept. A model that no rigid body can have is among the findings."""
    folder = Path(await run_in_threadpool(tempfile.mkdtemp, prefix="tauscope-robot-"))
    try:
        file_name = await _receive_robot(request, services, folder)
        return RobotReportAnswer.of(await services.reading.call(request, check_received_robot, folder, file_name))
    finally:
        await run_in_threadpool(shutil.rmtree, folder, ignore_errors=True)


async def _receive_robot(request: Request, services: ServicesDep, folder: Path) -> str:
    """Write the robot of a request into a folder; returns the robot file's name."""
    if media_type(request) == JSON:
        body = await read_document(request, RobotCheckRequest, services.settings.max_document_bytes)
        return await run_in_threadpool(keep_inline_robot, folder, body.robot)
    if media_type(request) != FORM:
        raise refuse_media_type(request, JSON, FORM)
    file = (await receive_form(request, robot_part_rules(folder))).file("robot")
    if file is None:
        raise ProblemError("invalid-request", "the form has no part robot; send the robot file as part robot")
    return file.name
