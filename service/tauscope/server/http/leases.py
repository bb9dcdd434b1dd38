"""Leases over HTTP: an arm of one's own for a while."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Path, Request, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from tauscope.errors import NotFoundError, one_line
from tauscope.robot.messages import shown
from tauscope.runtime.drivers import BackendName
from tauscope.server.auth.gate import find_caller
from tauscope.server.auth.keys import Scope
from tauscope.server.control.leases import LONGEST_TTL_S, Lease, LeaseLostError, Permit
from tauscope.server.http.answers import ROOT, AnswerModel
from tauscope.server.http.openapi import takes_document
from tauscope.server.http.services import Services, ServicesDep, document_of
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.strict_model import StrictModel
from tauscope.tasks.run import BackendChoice


class LeaseRequest(StrictModel):
    """Which arm is wanted."""

    robot: str = Field(min_length=1, max_length=200, description="what the robot file calls the robot")
    backend: BackendName | None = Field(default=None, description="what moves it; null: the service's own")
    ttl_s: float = Field(default=10.0, ge=1.0, le=LONGEST_TTL_S, description="how long it lasts without heartbeat [s]")
    holder: str = Field(default="", max_length=100, description="who wants it, for others to read; default: the key")
    take: bool = Field(default=False, description="take the arm from its holder, and stop it; needs the scope admin")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "lease": ("An arm for ten seconds, and longer with heartbeats", {"robot": "two-joint-arm", "backend": "sim"})
}


class LeaseLinks(AnswerModel):
    self_: str = Field(alias="self", description="the lease; DELETE gives it back")
    heartbeat: str = Field(description="where a POST is a sign of life")
    arm: str = Field(description="where a POST lets the arm move")
    disarm: str = Field(description="where a POST lets it move no more; what moves stops")


class LeaseAnswer(AnswerModel):
    id: str = Field(description="identifier", examples=["lease-7"])
    number: int = Field(description="above that of every earlier lease since the service started")
    token: str | None = Field(default=None, description="for the header Lease-Token; told once, to its holder")
    arm: str = Field(description="the arm", examples=["two-joint-arm on sim"])
    holder: str = Field(description="who has it")
    armed: bool = Field(description="whether the arm may move")
    ttl_s: float = Field(description="how long it lasts without a heartbeat [s]")
    seconds_left: float = Field(description="how long it still lasts without a heartbeat [s]")
    links: LeaseLinks = Field(description="what its holder does with it")


class LeaseListAnswer(AnswerModel):
    leases: list[LeaseAnswer] = Field(description="the newest first")


class StopAllAnswer(AnswerModel):
    runs: list[str] = Field(description="identifiers of the runs that were asked to stop")
    campaigns: list[str] = Field(description="identifiers of the campaigns that were asked to stop")
    time: datetime = Field(description="when, UTC")


LEASE_TOKEN = "Lease-Token"  # noqa: S105 - name of a header

LeaseToken = Annotated[
    str | None,
    Header(
        alias=LEASE_TOKEN,
        max_length=200,
        description="token of the arm's lease; a service without API keys asks for none unless somebody has a lease",
    ),
]


def find_owner(request: Request) -> str:
    return find_caller(request.scope).key or "local"


def permit_of(request: Request, services: Services, device: str) -> Permit:
    """Leave to move an arm, by the lease that comes with a request. Raises LeaseError if there is no such leave."""
    is_needed = services.settings.require_lease or find_caller(request.scope).key is not None
    return services.leases.permit(device, request.headers.get(LEASE_TOKEN), find_owner(request), is_needed=is_needed)


router = APIRouter(prefix="/leases", tags=["leases"])
stop_router = APIRouter(tags=["runs"])
Identifier = Annotated[str, Path(description="identifier of the lease", examples=["lease-7"])]
_HELD = problem_responses("lease-lost", "unauthorized")
NO_BODY = {"requestBody": {"required": False, "content": {}}}


@router.post(
    "",
    status_code=201,
    summary="Take the lease of an arm",
    response_model=LeaseAnswer,
    **takes_document(LeaseRequest, EXAMPLES, "leased", "busy"),
)
async def take_lease(
    wanted: Annotated[LeaseRequest, document_of(LeaseRequest)],
    request: Request,
    response: Response,
    services: ServicesDep,
) -> LeaseAnswer:
    """Exclusive: nobody else moves the arm while the lease holds. It ends by itself unless heartbeats renew it.

    Whatever moves by a lease stops when the lease ends. A service without API keys moves an arm without a lease too, as
    long as nobody has one; with keys, motion needs a lease that is armed.
    """
    caller = find_caller(request.scope)
    if wanted.take and not caller.scope.includes(Scope.ADMIN):
        raise ProblemError("forbidden", f"taking an arm needs a key of scope admin; the one of {caller.name} has less")
    device = BackendChoice(name=wanted.backend or services.settings.backend).device(wanted.robot)
    holder = one_line(wanted.holder) or caller.name
    lease = await run_in_threadpool(
        services.leases.acquire, device, holder, find_owner(request), wanted.ttl_s, take=wanted.take
    )
    answer = _answer(services, lease, token=lease.token)
    response.headers["Location"] = answer.links.self_
    return answer


@router.get("", summary="List leases")
async def list_leases(services: ServicesDep) -> LeaseListAnswer:
    """Those that hold, without their tokens."""
    return LeaseListAnswer(leases=[_answer(services, lease) for lease in services.leases.active()])


@router.get("/{identifier}", summary="Look a lease up", responses=problem_responses("not-found"))
async def get_lease(identifier: Identifier, services: ServicesDep) -> LeaseAnswer:
    """Who has which arm, and for how long."""
    lease = services.leases.find(identifier)
    if lease is None:
        raise NotFoundError(f"no lease {shown(identifier)} holds; list the leases")
    return _answer(services, lease)


async def _find_held(
    request: Request, identifier: Identifier, services: ServicesDep, token: LeaseToken
) -> tuple[str, str, str]:
    """The arm of a lease, the token that came with the request, and who sent it. Raises LeaseLostError."""
    lease = services.leases.find(identifier)
    if lease is None:
        raise LeaseLostError(f"{shown(identifier)}: this lease does not hold (any more); take a new one")
    return lease.device, token or "", find_owner(request)


Held = Annotated[tuple[str, str, str], Depends(_find_held)]


@router.post("/{identifier}/heartbeat", summary="Keep a lease", responses=_HELD, openapi_extra=NO_BODY)
async def keep_lease(held: Held, services: ServicesDep) -> LeaseAnswer:
    """A sign of life: the lease lasts for its whole time again. One that has ended is not brought back."""
    return _answer(services, services.leases.renew(*held))


@router.post("/{identifier}/arm", summary="Arm a lease", responses=_HELD, openapi_extra=NO_BODY)
async def arm_lease(held: Held, services: ServicesDep) -> LeaseAnswer:
    """From now on the arm moves when a run or a campaign is handed in with the lease. Every stop disarms."""
    return _answer(services, services.leases.arm(*held, armed=True))


@router.post("/{identifier}/disarm", summary="Disarm a lease", responses=_HELD, openapi_extra=NO_BODY)
async def disarm_lease(held: Held, services: ServicesDep) -> LeaseAnswer:
    """What moves by the lease stops; the arm is kept."""
    return _answer(services, services.leases.arm(*held, armed=False))


@router.delete("/{identifier}", status_code=204, summary="Give an arm back", responses=_HELD)
async def release_lease(held: Held, services: ServicesDep) -> None:
    """What moves by the lease stops. A lease that does not hold any more changes nothing for the present one."""
    services.leases.release(*held)


@stop_router.post("/stop", status_code=202, summary="Stop every arm", openapi_extra=NO_BODY)
async def stop_everything(services: ServicesDep) -> StopAllAnswer:
    """Stops all runs and campaigns and disarms all leases; needs no lease and no body, and waits for nothing."""
    services.leases.disarm_all()
    campaigns, runs = services.campaigns.stop_all(), services.runs.stop_all()
    return StopAllAnswer(runs=runs, campaigns=campaigns, time=datetime.now(UTC))


def _answer(services: Services, lease: Lease, token: str | None = None) -> LeaseAnswer:
    here = f"{ROOT}/leases/{lease.id}"
    links = LeaseLinks(self=here, heartbeat=f"{here}/heartbeat", arm=f"{here}/arm", disarm=f"{here}/disarm")
    left = round(services.leases.seconds_left(lease), 3)
    return LeaseAnswer.describe(
        lease, token=token, arm=lease.device, armed=lease.is_armed, seconds_left=left, links=links
    )
