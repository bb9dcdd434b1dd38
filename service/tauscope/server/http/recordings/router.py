"""Routes about recordings."""

from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.documents import file_answer, media_type, refuse_media_type
from tauscope.server.http.evidence import require_no_evidence
from tauscope.server.http.form import FORM, PartRule, receive_form
from tauscope.server.http.openapi import binary_part, form_body
from tauscope.server.http.reading import READING
from tauscope.server.http.recordings.models import RecordingAnswer, RecordingListAnswer, RecordingReportAnswer
from tauscope.server.http.services import ServicesDep
from tauscope.server.http.tasks.routes import After
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.server.queue.kept_recordings import check_kept_recording, read_kept_samples
from tauscope.server.store.recordings import StoredRecording

router = APIRouter(prefix="/recordings", tags=["recordings"], responses=problem_responses("invalid-request"))

Name = Annotated[str, Path(description="name of the recording", examples=["log-2026-11-03.csv"])]
JointCount = Annotated[int | None, Query(gt=0, le=1000, description="joints that the recording must have")]
MostSamples = Annotated[int, Query(ge=2, le=1_000_000, description="samples to return, about")]

RecordingLimit = Annotated[int, Query(ge=1, le=10_000, description="most entries of the list")]

_BODY = form_body({"file": binary_part("the recording: CSV, Parquet, MCAP or a rosbag2 database")}, required=["file"])


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
    if media_type(request) != FORM:
        raise refuse_media_type(request, FORM)
    folder = await run_in_threadpool(services.recordings.stage)
    try:
        rules = {"file": PartRule(services.settings.max_upload_bytes, folder)}
        file = (await receive_form(request, rules)).file("file")
        if file is None:
            raise ProblemError("invalid-request", "the form has no part file; send the recording as part file")
        kept, is_new = await run_in_threadpool(services.recordings.keep, file)
    finally:
        await run_in_threadpool(services.recordings.discard, folder)
    response.status_code = 201 if is_new else 200
    response.headers["Location"] = f"{request.url.path}/{quote(kept.name)}"
    return _answer(kept)


@router.get("", summary="List the recordings on the server")
def list_recordings(services: ServicesDep, limit: RecordingLimit = 1000, after: After = None) -> RecordingListAnswer:
    """Sent ones, and those that the operator put into the folder."""
    entries = [entry for entry in services.recordings.entries() if after is None or entry.name > after]
    page = [_answer(entry) for entry in entries[:limit]]
    return RecordingListAnswer(recordings=page, next=page[-1].name if len(entries) > limit else None)


@router.get("/{name}", summary="Look a recording up", responses=problem_responses("not-found"))
def get_recording(name: Name, services: ServicesDep) -> RecordingAnswer:
    """Size, time and sha256."""
    return _answer(services.recordings.find(name))


@router.get(
    "/{name}/report",
    summary="Check a recording",
    responses=problem_responses("not-found", "recording", "recording-mismatch", *READING),
)
async def report_on_recording(
    request: Request, name: Name, services: ServicesDep, joint_count: JointCount = None
) -> RecordingReportAnswer:
    """What it holds, and what to look at before trusting it."""
    path = await run_in_threadpool(services.recordings.path, name)
    report = await services.reading.call(request, check_kept_recording, path, joint_count)
    return RecordingReportAnswer.model_validate(report)


@router.get(
    "/{name}/samples",
    summary="Fetch samples of a recording for a plot",
    response_class=Response,
    responses={
        200: {"content": {"application/octet-stream": {}}, "description": "columns of 32-bit floats behind a header"},
        **problem_responses("not-found", "recording", *READING),
    },
)
async def get_samples(request: Request, name: Name, services: ServicesDep, most: MostSamples = 100_000) -> Response:
    """Time, positions and torques; of more samples than asked for, those that keep every column's look.

    Length of the header (4 bytes, little-endian), the header (JSON: `columns`, `joint_count`, `effort`, `samples`,
    `shown`), then each column as little-endian 32-bit floats; time counts from the first sample.
    """
    path = await run_in_threadpool(services.recordings.path, name)
    content = await services.reading.call(request, read_kept_samples, path, most)
    return Response(content, media_type="application/octet-stream")


@router.get(
    "/{name}/content",
    summary="Fetch a recording",
    response_class=FileResponse,
    responses={
        200: {"content": {"application/octet-stream": {}, "text/csv": {}}, "description": "the file"},
        **problem_responses("not-found"),
    },
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


def _answer(recording: StoredRecording) -> RecordingAnswer:
    """The answer that holds a recording's entry."""
    return RecordingAnswer.model_validate(recording)
