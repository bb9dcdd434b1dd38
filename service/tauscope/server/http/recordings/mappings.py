"""How a recording is read: its columns and units, before it is sent for good."""

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.documents import media_type, parse_document, refuse_media_type
from tauscope.server.http.form import FORM, PartRule, receive_form
from tauscope.server.http.openapi import binary_part, form_body, model_reference
from tauscope.server.http.reading import READING
from tauscope.server.http.recordings.models import ReadingRequest, UnderstandingAnswer
from tauscope.server.http.robots.files import read_received_robot, robot_part_rules
from tauscope.server.http.services import ServicesDep
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue.kept_recordings import understand_recording

router = APIRouter(prefix="/mappings", tags=["recordings"], responses=problem_responses("invalid-request"))

_BODY = form_body(
    {
        "file": binary_part("the recording: CSV, Parquet, MCAP or a rosbag2 database"),
        "robot": binary_part("the robot file, whose joints, limits and layout it is read by"),
        "urdf": binary_part("the URDF that the robot file names, by its bare name"),
        "request": model_reference(ReadingRequest),
    },
    required=["file"],
)


@router.post(
    "/check",
    summary="Check how a recording is read",
    responses=problem_responses("bad-request", "limit-exceeded", "media-type", "robot-file", *READING),
    openapi_extra={"requestBody": {"required": True, "content": _BODY}},
)
async def check_sent_recording(request: Request, services: ServicesDep) -> UnderstandingAnswer:
    """Its columns and units as they are understood, and what it holds when it is read so; nothing is kept."""
    if media_type(request) != FORM:
        raise refuse_media_type(request, FORM)
    folder = await run_in_threadpool(services.recordings.stage)
    try:
        settings, robots = services.settings, folder / "robot"
        await run_in_threadpool(robots.mkdir)
        rules = {
            "request": PartRule(settings.max_document_bytes),
            "file": PartRule(settings.max_upload_bytes, folder),
            **robot_part_rules(robots),
        }
        form = await receive_form(request, rules)
        file, robot_file = form.file("file"), form.file("robot")
        if file is None:
            raise ProblemError("invalid-request", "the form has no part file; send the recording as part file")
        options = parse_document(form.texts.get("request", b"{}"), ReadingRequest, within="part request")
        robot = robot_file and await run_in_threadpool(read_received_robot, robots, robot_file.name)
        found = await services.reading.call(request, understand_recording, file.path, robot, options.reading)
        return UnderstandingAnswer.model_validate(found)
    finally:
        await run_in_threadpool(services.recordings.discard, folder)
