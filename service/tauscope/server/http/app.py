"""The application: routes, problems and protection put together."""

from collections.abc import AsyncIterator
from concurrent.futures import Executor
from contextlib import asynccontextmanager

from fastapi import Depends, FastAPI

from tauscope.closed_loop import RolloutDocument
from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.plots import DiagnosisPlots
from tauscope.export.model_file import ModelFile
from tauscope.identification import IdentificationDocument
from tauscope.report.identification_plots import IdentificationPlots
from tauscope.server.auth.audited_requests import AuditedRequests
from tauscope.server.auth.gate import Gate
from tauscope.server.control.run_supervisor import StartControl
from tauscope.server.history.gates import ModelPolicy
from tauscope.server.http import health, pages
from tauscope.server.http.campaigns import CampaignRequest, CampaignResult
from tauscope.server.http.campaigns import router as campaigns
from tauscope.server.http.diagnoses import DiagnosisRequest
from tauscope.server.http.diagnoses import router as diagnoses
from tauscope.server.http.excitations import ExcitationRequest
from tauscope.server.http.excitations import router as excitations
from tauscope.server.http.heartbeat import notify_systemd
from tauscope.server.http.history import ReasonRequest
from tauscope.server.http.history import router as history
from tauscope.server.http.identifications import IdentificationRequest
from tauscope.server.http.identifications import router as identifications
from tauscope.server.http.items import router as items
from tauscope.server.http.leases import LeaseRequest, stop_router
from tauscope.server.http.leases import router as leases
from tauscope.server.http.methods import collect_methods, require_known_query
from tauscope.server.http.openapi import install_openapi
from tauscope.server.http.problem_handlers import install_problem_handlers
from tauscope.server.http.protection import BodyLimit, ConcurrencyLimiter, OriginCheck, RequestLog, ResponseProtection
from tauscope.server.http.recordings.mappings import router as mappings
from tauscope.server.http.recordings.models import ReadingRequest
from tauscope.server.http.recordings.router import router as recordings
from tauscope.server.http.repeated_requests import IdempotentRequests
from tauscope.server.http.robots.models import RobotCheckRequest
from tauscope.server.http.robots.router import router as robots
from tauscope.server.http.rollouts import RolloutRequest
from tauscope.server.http.rollouts import router as rollouts
from tauscope.server.http.runs import RunRequest
from tauscope.server.http.runs import router as runs
from tauscope.server.http.schedules import ScheduleRequest
from tauscope.server.http.schedules import router as schedules
from tauscope.server.http.services import open_services
from tauscope.server.http.settings import Settings
from tauscope.server.http.tasks.events import EVENT_MODELS
from tauscope.server.page.router import router as page
from tauscope.server.problems import Problem
from tauscope.trajectory.document import TrajectoryDocument

API_VERSION = "1.21.0"
"""Of the interface, not of the package; a change of tests/server/http/openapi.json goes with a change here."""

PREFIX = "/api/v1"


VERBS = (
    campaigns,
    excitations,
    runs,
    recordings,
    mappings,
    identifications,
    diagnoses,
    rollouts,
    robots,
    items,
    history,
    schedules,
    leases,
    stop_router,
)
"""Routers of everything that a client may ask for, below `PREFIX`."""

FORMATS = (
    IdentificationDocument,
    IdentificationPlots,
    DiagnosisDocument,
    DiagnosisPlots,
    RolloutDocument,
    CampaignResult,
    ModelFile,
    TrajectoryDocument,
)
"""Formats of files that tasks write, with versions of their own; `/docs/schemas/NAME` is the JSON Schema of each."""

REQUESTS = (
    IdentificationRequest,
    DiagnosisRequest,
    RolloutRequest,
    ExcitationRequest,
    RunRequest,
    CampaignRequest,
    RobotCheckRequest,
    ReadingRequest,
    LeaseRequest,
    ReasonRequest,
    ModelPolicy,
    ScheduleRequest,
)
"""Bodies that are read by hand, so that FastAPI does not find them."""


def create_app(settings: Settings, executor: Executor | None = None, start: StartControl | None = None) -> FastAPI:
    """The application; it takes the data folder when it starts and lets go of it when it stops."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with open_services(settings, executor, start) as services:
            app.state.services = services
            async with services.heartbeat.keep_beating(), notify_systemd():
                yield

    def is_closing() -> bool:
        return app.state.services.closing.is_set()

    app = FastAPI(
        title="Tauscope",
        summary="Finds a robot arm's true dynamics from its own motion.",
        description="Every failed request is answered with a problem (RFC 9457). SI units; joint numbers start at 1.",
        version=API_VERSION,
        lifespan=lifespan,
        generate_unique_id_function=lambda route: route.name,  # generated clients call their functions so
        docs_url=None,
        redoc_url=None,
    )
    for router in VERBS:
        app.include_router(router, prefix=PREFIX, dependencies=[Depends(require_known_query)])
    pages_too = [("", router) for router in (health.router, pages.router, page)]
    app.state.methods = collect_methods([*((PREFIX, router) for router in VERBS), *pages_too])
    app.include_router(health.router)
    app.include_router(pages.router)
    app.include_router(page)
    install_problem_handlers(app)
    install_openapi(app, [*REQUESTS, Problem, *EVENT_MODELS], FORMATS)
    # The last one added is the first to see a request.
    app.add_middleware(IdempotentRequests)
    app.add_middleware(AuditedRequests)
    app.add_middleware(Gate)
    app.add_middleware(BodyLimit, limit=settings.max_upload_bytes)
    app.add_middleware(OriginCheck, answers_for=settings.answers_for)
    app.add_middleware(ConcurrencyLimiter, is_closing=is_closing)
    app.add_middleware(RequestLog)
    app.add_middleware(ResponseProtection)
    return app
