"""Robots over HTTP: checked, kept, listed."""

from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Annotated

from fastapi import APIRouter, Path, Request, Response
from fastapi.concurrency import contextmanager_in_threadpool
from starlette.concurrency import run_in_threadpool

from tauscope.robot import RobotReport
from tauscope.server.http.bodies import FORM, JSON, media_type, read_document, receive_form, refuse_media_type
from tauscope.server.http.openapi import ROBOT_PARTS, form_body, json_body
from tauscope.server.http.reading import READING
from tauscope.server.http.services import ServicesDep, require_no_identification
from tauscope.server.http.tasks.router import JobRobotAnswer, describe_robot
from tauscope.server.http.tasks.submission import (
    EXAMPLE_ROBOT,
    RobotCheckRequest,
    RobotVersionAnswer,
    keep_inline_robot,
    robot_part_rules,
)
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue.received_files import check_received_robot, read_received_robot
from tauscope.server.store.robots import VERSION_PATTERN

router = APIRouter(prefix="/robots", tags=["robots"])
_BODY = {
    **json_body(RobotCheckRequest, {"inline": ("A robot as JSON", {"robot": EXAMPLE_ROBOT})}),
    **form_body(ROBOT_PARTS, required=["robot"]),
}


@router.post(
    "/check",
    summary="Check a robot file",
    response_model=RobotReport,
    responses=problem_responses("bad-request", "media-type", "robot-file", *READING),
    openapi_extra={"requestBody": {"required": True, "content": _BODY}},
)
async def check_robot_file(request: Request, services: ServicesDep) -> RobotReport:
    """Summary and findings; nothing is kept. A model that no rigid body can have is among the findings."""
    async with contextmanager_in_threadpool(TemporaryDirectory(prefix="tauscope-robot-")) as name:
        folder = FilePath(name)
        file_name = await _receive_robot(request, services, folder)
        return await services.reading.call(request, check_received_robot, folder, file_name)


Version = Annotated[str, Path(description="version of the robot", pattern=VERSION_PATTERN)]


@router.post(
    "",
    status_code=201,
    summary="Keep a robot",
    response_model=RobotVersionAnswer,
    responses={200: {"model": RobotVersionAnswer}, **problem_responses("robot-file", "media-type", *READING)},
    openapi_extra={"requestBody": {"required": True, "content": _BODY}},
)
async def keep_robot_version(request: Request, response: Response, services: ServicesDep) -> RobotVersionAnswer:
    """The same content is the same version, kept once. Requests name it as `robot: {version: …}`."""
    async with contextmanager_in_threadpool(services.robots.stage()) as folder:
        file_name = await _receive_robot(request, services, folder)
        robot = await services.reading.call(request, read_received_robot, folder, file_name)
        kept, is_new = await run_in_threadpool(services.robots.keep, folder, file_name, robot.name)
    answer = RobotVersionAnswer.of(kept)
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = answer.link
    return answer


@router.get(
    "/versions/{version}",
    summary="Fetch a kept robot",
    responses=problem_responses("not-found", "robot-file", *READING),
)
async def get_robot_version(request: Request, version: Version, services: ServicesDep) -> JobRobotAnswer:
    """Its joints, limits and frames, and its files."""
    kept = await run_in_threadpool(services.robots.find, version)
    return await describe_robot(request, services, services.robots.files(version), kept.robot_file)


@router.delete(
    "/versions/{version}",
    status_code=204,
    summary="Remove a kept robot",
    responses=problem_responses("not-found", "in-use"),
)
def remove_robot_version(version: Version, services: ServicesDep) -> None:
    """Not while an active model or a reference was identified with it. Jobs have copies of their own."""
    services.robots.find(version)
    require_no_identification(services, version)
    services.robots.remove(version)


async def _receive_robot(request: Request, services: ServicesDep, folder: FilePath) -> str:
    if media_type(request) == JSON:
        body = await read_document(request, RobotCheckRequest, services.settings.max_document_bytes)
        return await run_in_threadpool(keep_inline_robot, folder, body.robot)
    if media_type(request) != FORM:
        raise refuse_media_type(request, JSON, FORM)
    file = (await receive_form(request, robot_part_rules(folder))).file("robot")
    if file is None:
        raise ProblemError("invalid-request", "the form has no part robot; send the robot file as part robot")
    return file.name
