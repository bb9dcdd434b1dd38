"""Routes about runs."""

from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.documents import file_answer
from tauscope.server.http.jobs.events import add_events_route
from tauscope.server.http.jobs.routes import MOTION, SUBMISSION, Identifier, Limit, collection
from tauscope.server.http.jobs.submission import request_body
from tauscope.server.http.leases.router import LeaseToken
from tauscope.server.http.openapi import binary_part
from tauscope.server.http.robots.of_job import add_robot_route
from tauscope.server.http.runs.models import EXAMPLES, RecordingFormat, RunAnswer, RunListAnswer, RunRequest, StopAnswer
from tauscope.server.http.runs.status import describe, find_run, followed_run, require_recording
from tauscope.server.http.runs.submission import submit_run
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.problems import ProblemError, problem_responses

router = APIRouter(prefix="/runs", tags=["runs"], responses=problem_responses("invalid-request"))

Format = Annotated[RecordingFormat, Query(alias="format", description="mcap: the journal, ramp included; else columns")]

_PARTS = {"trajectory": binary_part("the motion: a trajectory document (.json), or samples (.csv)")}


@router.post(
    "",
    status_code=202,
    summary="Begin a run",
    response_model=RunAnswer,
    responses=problem_responses(*SUBMISSION, *MOTION, "not-found", "not-finished", "excitation", "queue-full"),
    openapi_extra=request_body(RunRequest, EXAMPLES, _PARTS),
)
async def hand_in(request: Request, response: Response, services: ServicesDep, _lease: LeaseToken = None) -> RunAnswer:
    """The arm moves as soon as there is a motion: follow `Location` until it has ended, or stop it at any time.

    One run at a time has an arm. Where somebody has the arm's lease, only they move it; it stops when the lease ends.
    Every command passes a guard that keeps the robot file's limits.
    """
    identifier = await submit_run(request, services)
    answer = await run_in_threadpool(describe, services, identifier, collection(request, 1))
    response.headers["Location"] = answer.links.self_
    return answer


@router.get("", summary="List runs")
def list_runs(request: Request, services: ServicesDep, limit: Limit = 100) -> RunListAnswer:
    """The newest first."""
    identifiers = services.runs.items.identifiers()[:limit]
    return RunListAnswer(runs=[describe(services, identifier, collection(request, 1)) for identifier in identifiers])


@router.get("/{identifier}", summary="Follow a run", responses=problem_responses("not-found"))
def get_run(request: Request, identifier: Identifier, services: ServicesDep) -> RunAnswer:
    """Its state, how far it is, what was measured, and where to go on from there."""
    return describe(services, identifier, collection(request, 2))


@router.post(
    "/{identifier}/stop",
    status_code=202,
    summary="Stop a run",
    responses={**problem_responses("not-found"), 202: {"description": "it stops, or had ended already"}},
    openapi_extra={"requestBody": {"required": False, "content": {}}},
)
async def stop_run(identifier: Identifier, services: ServicesDep) -> StopAnswer:
    """Stops the arm by the run's stop policy; legal in every state, any number of times; needs no body.

    It waits for nothing: neither for other requests nor for jobs. The recording up to the stop is kept.
    """
    # Neither a thread of the pool nor a lock is needed for a run that goes on: whatever is stuck, this is not.
    live = services.runs.stop(identifier)
    if live is not None:
        return StopAnswer(id=identifier, state=live.state)
    record = find_run(services, identifier).read_run()
    if record is None:
        raise ProblemError("damaged", f"files of {identifier} are missing or damaged; it does not go on")
    return StopAnswer(id=identifier, state=record.state)


@router.get(
    "/{identifier}/recording",
    summary="Fetch the recording of a run",
    response_class=FileResponse,
    responses={
        200: {"content": {"application/octet-stream": {}, "text/csv": {}}, "description": "the file"},
        **problem_responses("not-found", "not-finished"),
    },
)
def get_recording(identifier: Identifier, services: ServicesDep, format_: Format = "csv") -> FileResponse:
    """What was measured; also of a run that was stopped or interrupted, as far as it came."""
    workspace = require_recording(services, identifier, format_)
    return file_answer(workspace.recording(format_), f"run-{identifier}.{format_}")


@router.delete(
    "/{identifier}",
    status_code=204,
    summary="Remove a run",
    responses=problem_responses("not-found", "not-finished"),
)
def remove_run(identifier: Identifier, services: ServicesDep) -> None:
    """One that has ended is removed with all its files; its recording stays among the recordings."""
    if not services.runs.remove(identifier):
        raise ProblemError("not-finished", f"{identifier} goes on; stop it, and remove it when it has ended")


add_events_route(router, "a run", followed_run)


def _robot(services: Services, identifier: str) -> tuple[Path, str | None]:
    """Where the robot of a run lies."""
    workspace = find_run(services, identifier)
    order = workspace.read_request()
    return workspace.robot, None if order is None else order.robot_file


add_robot_route(router, "a run", _robot)
