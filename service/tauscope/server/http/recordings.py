"""Recordings over HTTP: sent, listed, checked, and how one is read before it is sent for good."""

from datetime import datetime
from pathlib import Path as FilePath
from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.concurrency import contextmanager_in_threadpool
from fastapi.responses import FileResponse
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from tauscope.recording import RecordingReport
from tauscope.server.http.answers import After, AnswerModel, PageAnswer
from tauscope.server.http.bodies import PartRule, ReceivedForm, file_answer, parse_document, receive_form
from tauscope.server.http.openapi import ROBOT_PARTS, binary_part, file_responses, form_body, refer_to_model
from tauscope.server.http.reading import READING
from tauscope.server.http.services import ServicesDep, require_no_evidence
from tauscope.server.http.tasks.submission import robot_part_rules
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue import received_files
from tauscope.server.store.files import KeptFile
from tauscope.tasks.task import ReadingOptions


class RecordingAnswer(AnswerModel):
    name: str = Field(description="by which requests refer to it", examples=["log-2026-11-03.csv"])
    size: int = Field(description="number of bytes", examples=[1830221])
    modified: datetime = Field(description="when it was last written, UTC")
    sha256: str | None = Field(description="of its bytes, in hexadecimal; null in a list where it was not computed yet")
    is_damaged: bool = Field(description="whether it was sent or recorded, and its bytes are not those any more")


class RecordingListAnswer(PageAnswer):
    recordings: list[RecordingAnswer] = Field(description="by name")


class ReadingRequest(ReadingOptions):
    """How a recording is to be read."""


router = APIRouter(prefix="/recordings", tags=["recordings"])
Name = Annotated[str, Path(description="name of the recording", examples=["log-2026-11-03.csv"])]
JointCount = Annotated[int | None, Query(gt=0, le=1000, description="joints that the recording must have")]
MostSamples = Annotated[int, Query(ge=2, le=1_000_000, description="samples to return, about")]
RecordingLimit = Annotated[int, Query(ge=1, le=10_000, description="most entries of the list")]
_FILE = binary_part("the recording: CSV, Parquet, NumPy, MATLAB, JSON, MCAP or a bag")
_BODY = form_body({"file": _FILE}, required=["file"])


@router.post(
    "",
    status_code=201,
    summary="Keep a recording on the server",
    response_model=RecordingAnswer,
    responses={
        200: {"model": RecordingAnswer, "description": "the very same bytes were already kept under that name"},
        **problem_responses("bad-request", "limit-exceeded", "media-type", "name-taken", "storage-full"),
    },
    openapi_extra={"requestBody": {"required": True, "content": _BODY}},
)
async def keep_recording(request: Request, response: Response, services: ServicesDep) -> RecordingAnswer:
    """The file is kept under its own name; nothing is ever overwritten."""
    async with contextmanager_in_threadpool(services.recordings.stage()) as folder:
        rules = {"file": PartRule(services.settings.max_upload_bytes, FilePath(folder))}
        file = _require_file(await receive_form(request, rules))
        kept, is_new = await run_in_threadpool(services.recordings.keep, file)
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"{request.url.path}/{quote(kept.name)}"
    return RecordingAnswer.model_validate(kept)


@router.get("", summary="List the recordings on the server")
def list_recordings(services: ServicesDep, limit: RecordingLimit = 1000, after: After = None) -> RecordingListAnswer:
    """Sent ones, and those that the operator put into the folder."""
    entries = [entry for entry in services.recordings.entries() if after is None or entry.name > after]
    page = [RecordingAnswer.model_validate(entry) for entry in entries[:limit]]
    return RecordingListAnswer(recordings=page, next=page[-1].name if len(entries) > limit else None)


@router.get("/{name}", summary="Look a recording up", responses=problem_responses("not-found"))
def get_recording(name: Name, services: ServicesDep) -> RecordingAnswer:
    """Size, time and sha256."""
    return RecordingAnswer.model_validate(services.recordings.find(name))


@router.get(
    "/{name}/report",
    summary="Check a recording",
    responses=problem_responses("not-found", "recording", "recording-mismatch", *READING),
)
async def report_on_recording(
    request: Request, name: Name, services: ServicesDep, joint_count: JointCount = None
) -> RecordingReport:
    """What it holds, and what to look at before trusting it."""
    path = await run_in_threadpool(services.recordings.path, name)
    return await services.reading.call(request, received_files.check_kept_recording, path, joint_count)


@router.get(
    "/{name}/samples",
    summary="Fetch samples of a recording for a plot",
    response_class=Response,
    responses=file_responses(
        ("application/octet-stream",),
        "not-found",
        "recording",
        *READING,
        description="columns of 32-bit floats behind a header",
    ),
)
async def get_samples(request: Request, name: Name, services: ServicesDep, most: MostSamples = 100_000) -> Response:
    """Time, positions and torques; of more samples than asked for, those that keep every column's look.

    Length of the header (4 bytes, little-endian), the header (JSON: `columns`, `joint_count`, `effort`, `samples`,
    `shown`), then each column as little-endian 32-bit floats; time counts from the first sample.
    """
    path = await run_in_threadpool(services.recordings.path, name)
    content = await services.reading.call(request, received_files.read_kept_samples, path, most)
    return Response(content, media_type="application/octet-stream")


@router.get(
    "/{name}/content",
    summary="Fetch a recording",
    response_class=FileResponse,
    responses=file_responses(("application/octet-stream", "text/csv"), "not-found"),
)
def get_content(name: Name, services: ServicesDep) -> FileResponse:
    """The very bytes that are kept."""
    return file_answer(services.recordings.path(name), name)


@router.delete(
    "/{name}",
    status_code=204,
    summary="Remove a recording",
    responses=problem_responses("not-found", "in-use", "store"),
)
def remove_recording(name: Name, services: ServicesDep) -> None:
    """Identifications that wait for it will fail; one that a model in use rests on stays."""
    services.recordings.path(name)
    require_no_evidence(services, name)
    services.recordings.remove(name)


mapping_router = APIRouter(prefix="/mappings", tags=["recordings"], responses=problem_responses("invalid-request"))

_MAPPING_BODY = form_body(
    {
        "file": _FILE,
        **ROBOT_PARTS,
        "request": refer_to_model(ReadingRequest),
    },
    required=["file"],
)


@mapping_router.post(
    "/check",
    summary="Check how a recording is read",
    responses=problem_responses("bad-request", "limit-exceeded", "media-type", "robot-file", *READING),
    openapi_extra={"requestBody": {"required": True, "content": _MAPPING_BODY}},
)
async def check_sent_recording(request: Request, services: ServicesDep) -> received_files.Understanding:
    """Its columns and units as they are understood, and what it holds when it is read so; nothing is kept."""
    async with contextmanager_in_threadpool(services.recordings.stage()) as folder:
        settings, robots = services.settings, FilePath(folder) / "robot"
        await run_in_threadpool(robots.mkdir)
        rules = {
            "request": PartRule(settings.max_document_bytes),
            "file": PartRule(settings.max_upload_bytes, FilePath(folder)),
            **robot_part_rules(robots),
        }
        form = await receive_form(request, rules)
        file, robot_file = _require_file(form), form.file("robot")
        options = parse_document(form.texts.get("request", b"{}"), ReadingRequest, within="part request")
        robot = robot_file and await run_in_threadpool(received_files.read_received_robot, robots, robot_file.name)
        return await services.reading.call(
            request, received_files.understand_recording, file.path, robot, options.reading
        )


def _require_file(form: ReceivedForm) -> KeptFile:
    file = form.file("file")
    if file is None:
        raise ProblemError("invalid-request", "the form has no part file; send the recording as part file")
    return file
