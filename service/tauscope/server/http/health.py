"""Health: whether the service is there, whether it can work, and its metrics."""

import os
import tempfile
from pathlib import Path
from typing import Literal

import anyio
from anyio import to_thread
from fastapi import APIRouter, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.metrics import CONTENT_TYPE
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.models import AnswerModel
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.version import tauscope_version

LEAST_FREE_BYTES = 64 * 2**20
"""Room on the disk below which no run should begin [bytes]."""

TIMEOUT_S = 2.0
"""How long the disk may take [s]."""


def find_obstacles(services: Services) -> list[str]:
    """Everything that stands in the way of work, each in a few words; asks the disk, so that it may hang."""
    found = ["the service is ending"] if services.closing.is_set() else []
    if not services.jobs.can_work():
        found.append("the Dask cluster does not answer, and jobs wait for it")
    if services.audit.lost:
        found.append(f"{services.audit.lost} entries of the audit log were lost")
    return found + _disk_obstacles(services.settings.data_folder)


def _disk_obstacles(folder: Path) -> list[str]:
    """What is wrong with the data folder: a file is really written."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"ready?")
            file.flush()
            os.fsync(file.fileno())
        status = os.statvfs(folder)
    except OSError as error:
        return [f"the data folder cannot be written to ({error.strerror})"]
    free = status.f_bavail * status.f_frsize
    return [] if free >= LEAST_FREE_BYTES else [f"the disk has {free // 2**20} MiB left"]


router = APIRouter(tags=["health"])


class HealthAnswer(AnswerModel):
    """The service is there."""

    status: Literal["ok"] = Field(description="always ok: a service that cannot answer does not")
    version: str = Field(description="of Tauscope", examples=["0.1.0"])


class ReadyAnswer(AnswerModel):
    """The service can work."""

    status: Literal["ready"] = Field(description="always ready: else the answer is a problem")


@router.get("/healthz", summary="Ask whether the service is there")
async def get_health() -> HealthAnswer:
    """Answers without touching the disk."""
    return HealthAnswer(status="ok", version=tauscope_version())


@router.get("/readyz", summary="Ask whether the service can work", responses=problem_responses("not-ready"))
async def get_readiness(services: ServicesDep) -> ReadyAnswer:
    """Writes to the disk and looks at its room; a disk that hangs is an answer too."""
    found = [f"the disk has not answered within {TIMEOUT_S:g} s"]
    with anyio.move_on_after(TIMEOUT_S):
        found = await to_thread.run_sync(find_obstacles, services, abandon_on_cancel=True, limiter=services.followers)
    if found:
        raise ProblemError("not-ready", "; ".join(found), headers={"Retry-After": "5"})
    return ReadyAnswer(status="ready")


@router.get(
    "/metrics",
    summary="Fetch the metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}, "description": "in Prometheus' text format"}},
)
async def get_metrics(services: ServicesDep) -> Response:
    """For Prometheus: requests, jobs, runs, and how well the control loops kept their time."""
    return Response(await run_in_threadpool(services.metrics.text), headers={"content-type": CONTENT_TYPE})
