"""Excitations: requests, answers and what is special about this resource."""

from collections.abc import AsyncIterator
from typing import Annotated, Any, Literal

from fastapi import Query, Request, Response
from fastapi.responses import StreamingResponse
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.answers import ENDINGS, Identifier, JobAnswer, JobLinks, require_document
from tauscope.server.http.openapi import file_responses
from tauscope.server.http.reading import READING
from tauscope.server.http.services import ServicesDep
from tauscope.server.http.tasks.queued import JobDocument, QueuedTask
from tauscope.server.http.tasks.submission import EXAMPLE_ROBOT, RobotRequest
from tauscope.server.queue.analyses import ExcitationWorkspace, write_trajectory_piece
from tauscope.server.store.files import read_bytes
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.trajectory.csv_format import PIECE_ROWS


class ExcitationRequest(RobotRequest):
    """Which motion is wanted."""

    options: ExcitationDesignOptions = Field(default=ExcitationDesignOptions(), description="how the motion is made")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "default": ("The default motion", {"robot": EXAMPLE_ROBOT}),
    "floor": (
        "Shorter periods, above a floor",
        {"robot": EXAMPLE_ROBOT, "options": {"duration_s": 8.0, "harmonics": 4, "periods": 6, "floor_m": -0.3}},
    ),
}


class ExcitationLinks(JobLinks):
    result: str | None = Field(default=None, description="its document, once it succeeded")
    trajectory: str | None = Field(default=None, description="its trajectory, once it succeeded")


class ExcitationAnswer(JobAnswer):
    options: ExcitationDesignOptions | None = Field(default=None, description="how the motion is designed")
    links: ExcitationLinks = Field(description="where to go on")


TrajectoryFormat = Annotated[
    Literal["json", "csv"],
    Query(alias="format", description="json: exact coefficients; csv: samples that any controller can play"),
]
Rate = Annotated[float, Query(gt=0.0, le=10_000.0, description="samples a second of the CSV [Hz]")]

EXCITATIONS = QueuedTask(
    noun="an excitation",
    workspace=ExcitationWorkspace,
    models=(ExcitationRequest, ExcitationAnswer),
    examples=EXAMPLES,
    summary="Have a motion designed",
    words="The robot is checked at once, the motion is designed by the job: follow `Location` until it has ended.",
    problems=("queue-full",),
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
    responses=file_responses(
        ("application/json", "text/csv"), "not-found", *ENDINGS, "excitation", "internal", *READING
    ),
)
async def get_trajectory(
    request: Request,
    identifier: Identifier,
    services: ServicesDep,
    format_: TrajectoryFormat = "json",
    rate_hz: Rate = 500.0,
) -> Response:
    """The motion for Tauscope itself (json) or for another controller (csv)."""
    workspace = await run_in_threadpool(EXCITATIONS.finished, services, identifier)
    if format_ == "json":
        content = require_document(await run_in_threadpool(read_bytes, workspace.trajectory), identifier)
        return Response(content, headers=_name_file("json"), media_type="application/json")
    # The first piece is made before the answer begins: its problem is the answer's.
    first = await services.reading.call(request, write_trajectory_piece, workspace, rate_hz, 0)

    async def write_pieces() -> AsyncIterator[bytes]:
        piece, start = first, 0
        while piece:
            yield piece
            start += PIECE_ROWS
            piece = await services.reading.call(request, write_trajectory_piece, workspace, rate_hz, start)

    return StreamingResponse(write_pieces(), headers=_name_file("csv"), media_type="text/csv")


def _name_file(suffix: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="trajectory.{suffix}"'}
