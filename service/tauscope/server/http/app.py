"""The application: routes, problems and protection put together."""

from collections.abc import AsyncIterator
from concurrent.futures import Executor
from contextlib import asynccontextmanager

from fastapi import Depends, FastAPI

from tauscope.server.auth.gate import AuditedRequests, Gate
from tauscope.server.control.run_manager import StartControl
from tauscope.server.http import (
    analyses,
    campaigns,
    excitations,
    health,
    history,
    items,
    leases,
    pages,
    recordings,
    robots,
    runs,
    schedules,
)
from tauscope.server.http.openapi import install_openapi
from tauscope.server.http.problem_handlers import collect_methods, install_problem_handlers, require_known_query
from tauscope.server.http.protection import BodyLimit, ConcurrencyLimiter, OriginCheck, RequestLog, ResponseProtection
from tauscope.server.http.readiness import notify_systemd
from tauscope.server.http.repeated_requests import IdempotentRequests
from tauscope.server.http.services import open_services
from tauscope.server.http.settings import Settings
from tauscope.server.page.router import router as page

API_VERSION = "1.23.0"
"""Of the interface, not of the package; a change of tests/server/http/openapi.json goes with a change here."""
PREFIX = "/api/v1"
VERBS = (
    *(module.router for module in (campaigns, excitations, runs, recordings)),
    *analyses.routers,
    *(module.router for module in (robots, items, history, schedules, leases)),
    *(recordings.mapping_router, leases.stop_router),
)
"""Routers of everything that a client may ask for, below `PREFIX`."""
PAGES = (health.router, pages.router, page)


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
    for router in PAGES:
        app.include_router(router)
    app.state.methods = collect_methods([*((PREFIX, router) for router in VERBS), *(("", router) for router in PAGES)])
    install_problem_handlers(app)
    install_openapi(app)
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
