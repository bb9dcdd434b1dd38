"""The application: routes, problems and protection put together."""

from collections.abc import AsyncIterator
from concurrent.futures import Executor
from contextlib import asynccontextmanager

from fastapi import FastAPI

from service.api import health, pages
from service.api.access.gate import Gate
from service.api.audit.recorder import Audited
from service.api.body_limit import BodyLimit
from service.api.campaigns.models import CampaignRequest
from service.api.campaigns.router import router as campaigns
from service.api.diagnoses.models import DiagnosisRequest
from service.api.diagnoses.router import router as diagnoses
from service.api.excitations.models import ExcitationRequest
from service.api.excitations.router import router as excitations
from service.api.history.models import ReasonRequest
from service.api.history.router import router as history
from service.api.idempotency.repeatable import Repeatable
from service.api.identifications.models import IdentificationRequest
from service.api.identifications.router import router as identifications
from service.api.items.router import router as items
from service.api.jobs.events import EVENT_MODELS
from service.api.leases.models import LeaseRequest
from service.api.leases.router import router as leases
from service.api.leases.router import stop_router
from service.api.openapi import install_openapi
from service.api.opening import open_services
from service.api.operations.observed import Observed
from service.api.operations.systemd import told
from service.api.page.router import router as page
from service.api.problem_handlers import install_problem_handlers
from service.api.problems import Problem
from service.api.protection import KnownCallers, SafeAnswers
from service.api.recordings.router import router as recordings
from service.api.robots.models import RobotCheckRequest
from service.api.robots.router import router as robots
from service.api.runs.models import RunRequest
from service.api.runs.router import router as runs
from service.api.schedules.models import ScheduleRequest
from service.api.schedules.router import router as schedules
from service.api.settings import Settings
from service.api.turns import TakingTurns
from service.identification.history import ModelPolicy
from service.jobs import StartControl

API_VERSION = "1.9.1"
"""Of the interface, not of the package; a change of tests/api/openapi.json goes with a change here."""

PREFIX = "/api/v1"


VERBS = (
    campaigns,
    excitations,
    runs,
    recordings,
    identifications,
    diagnoses,
    robots,
    items,
    history,
    schedules,
    leases,
    stop_router,
)
"""Routers of everything that a client may ask for, below `PREFIX`."""

REQUESTS = (
    IdentificationRequest,
    DiagnosisRequest,
    ExcitationRequest,
    RunRequest,
    CampaignRequest,
    RobotCheckRequest,
    LeaseRequest,
    ReasonRequest,
    ModelPolicy,
    ScheduleRequest,
)
"""Bodies that are read by hand, so that FastAPI does not find them."""


def create_app(settings: Settings, executor: Executor | None = None, start: StartControl | None = None) -> FastAPI:
    """The application; it takes the data folder when it starts and lets go of it when it stops.

    Parameters
    ----------
    settings : Settings
        of the operator
    executor : Executor or None
        where the work is done; processes of our own where None
    start : callable or None
        starts the control process of a run; one of our own where None
    """

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with open_services(settings, executor, start) as services:
            app.state.services = services
            async with services.pulse.beating(), told():
                yield

    app = FastAPI(
        title="Tauscope",
        summary="Finds a robot arm's true dynamics from its own motion.",
        description="Every failed request is answered with a problem (RFC 9457). SI units; joint numbers start at 1.",
        version=API_VERSION,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
    )
    for router in VERBS:
        app.include_router(router, prefix=PREFIX)
    app.include_router(health.router)
    app.include_router(pages.router)
    app.include_router(page)
    install_problem_handlers(app)
    install_openapi(app, [*REQUESTS, Problem, *EVENT_MODELS])
    # The last one added is the first to see a request.
    app.add_middleware(Repeatable)
    app.add_middleware(Audited)
    app.add_middleware(Gate)
    app.add_middleware(BodyLimit, limit=settings.max_upload_bytes)
    app.add_middleware(KnownCallers, answers_for=settings.answers_for)
    app.add_middleware(TakingTurns)
    app.add_middleware(Observed)
    app.add_middleware(SafeAnswers)
    return app
