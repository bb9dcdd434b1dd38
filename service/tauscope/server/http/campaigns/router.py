"""Routes about campaigns."""

from pathlib import Path

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.campaigns.models import (
    EXAMPLES,
    CampaignAnswer,
    CampaignListAnswer,
    CampaignRequest,
    CampaignResult,
    CampaignStopAnswer,
)
from tauscope.server.http.campaigns.status import describe, find_campaign, result_of
from tauscope.server.http.campaigns.submission import submit_campaign
from tauscope.server.http.jobs.events import add_events_route
from tauscope.server.http.jobs.routes import ENDINGS, MOTION, SUBMISSION, Identifier, Limit, collection
from tauscope.server.http.jobs.submission import request_body
from tauscope.server.http.leases.router import LeaseToken
from tauscope.server.http.robots.of_job import add_robot_route
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.problems import ProblemError, problem_responses

router = APIRouter(prefix="/campaigns", tags=["campaigns"], responses=problem_responses("invalid-request"))


@router.post(
    "",
    status_code=202,
    summary="Begin a campaign",
    response_model=CampaignAnswer,
    responses=problem_responses(*SUBMISSION, *MOTION),
    openapi_extra=request_body(CampaignRequest, EXAMPLES),
)
async def hand_in(
    request: Request, response: Response, services: ServicesDep, _lease: LeaseToken = None
) -> CampaignAnswer:
    """Designs a motion, runs it, runs a second one that the model is judged by, and identifies the arm.

    The campaign has the arm until its motions are done. Follow `Location` until it has ended, or stop it at any time.
    """
    identifier = await submit_campaign(request, services)
    answer = await run_in_threadpool(describe, services, identifier, collection(request, 1))
    response.headers["Location"] = answer.links.self_
    return answer


@router.get("", summary="List campaigns")
def list_campaigns(request: Request, services: ServicesDep, limit: Limit = 100) -> CampaignListAnswer:
    """The newest first."""
    identifiers, root = services.campaigns.items.identifiers()[:limit], collection(request, 1)
    return CampaignListAnswer(campaigns=[describe(services, identifier, root) for identifier in identifiers])


@router.get("/{identifier}", summary="Follow a campaign", responses=problem_responses("not-found"))
def get_campaign(request: Request, identifier: Identifier, services: ServicesDep) -> CampaignAnswer:
    """Its state, its steps, and what it has made so far."""
    return describe(services, identifier, collection(request, 2))


@router.get(
    "/{identifier}/result",
    summary="Fetch the result",
    responses=problem_responses(
        "not-found",
        *ENDINGS,
        "robot-file",
        "excitation",
        "scenario",
        "acquisition",
        "recording",
        "identification",
        "worker-lost",
        "internal",
    ),
)
def get_result(request: Request, identifier: Identifier, services: ServicesDep) -> CampaignResult:
    """The identified model, and everything that led to it; else the problem that the campaign ended in."""
    return result_of(services, identifier, collection(request, 3))


@router.post(
    "/{identifier}/stop",
    status_code=202,
    summary="Stop a campaign",
    responses={**problem_responses("not-found"), 202: {"description": "it stops, or had ended already"}},
    openapi_extra={"requestBody": {"required": False, "content": {}}},
)
async def stop_campaign(identifier: Identifier, services: ServicesDep) -> CampaignStopAnswer:
    """Stops the arm first, then everything else of it; legal in every state, any number of times; needs no body."""
    # As for a run: no thread of the pool and no lock is needed for one that goes on.
    state = services.campaigns.stop(identifier)
    if state is not None:
        return CampaignStopAnswer(id=identifier, state=state)
    record = find_campaign(services, identifier).read_record()
    if record is None:
        raise ProblemError("damaged", f"files of {identifier} are missing or damaged; it does not go on")
    return CampaignStopAnswer(id=identifier, state=record.state)


@router.delete(
    "/{identifier}",
    status_code=204,
    summary="Remove a campaign",
    responses=problem_responses("not-found", "not-finished"),
)
def remove_campaign(identifier: Identifier, services: ServicesDep) -> None:
    """One that has ended is removed; its excitations, runs, recordings and identification stay."""
    if not services.campaigns.remove(identifier):
        raise ProblemError("not-finished", f"{identifier} goes on; stop it, and remove it when it has ended")


add_events_route(router, "a campaign", find_campaign)


def _robot(services: Services, identifier: str) -> tuple[Path, str | None]:
    """Where the robot of a campaign lies."""
    workspace = find_campaign(services, identifier)
    order = workspace.read_order()
    return workspace.robot, None if order is None else order.robot_file


add_robot_route(router, "a campaign", _robot)
