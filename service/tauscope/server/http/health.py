"""Health: whether the service is there, whether it can work, and its metrics."""

from typing import Literal

from fastapi import APIRouter, Response
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from tauscope.server.http.answers import AnswerModel
from tauscope.server.http.metrics import CONTENT_TYPE
from tauscope.server.http.openapi import file_responses
from tauscope.server.http.services import ServicesDep
from tauscope.server.problems import ProblemError, problem_responses
from tauscope.version import tauscope_version

router = APIRouter(tags=["health"])


class HealthAnswer(AnswerModel):
    status: Literal["ok"] = Field(description="always ok: a service that cannot answer does not")
    version: str = Field(description="of Tauscope", examples=["0.1.0"])


class ReadyAnswer(AnswerModel):
    status: Literal["ready"] = Field(description="always ready: else the answer is a problem")


@router.get("/healthz", summary="Ask whether the service is there")
async def get_health() -> HealthAnswer:
    """Answers without touching the disk."""
    return HealthAnswer(status="ok", version=tauscope_version())


@router.get("/readyz", summary="Ask whether the service can work", responses=problem_responses("not-ready"))
async def get_readiness(services: ServicesDep) -> ReadyAnswer:
    """Asks database, disk, workers and clock; one that hangs is an answer too."""
    found = await services.readiness.find_obstacles()
    if found:
        raise ProblemError("not-ready", "; ".join(found), headers={"Retry-After": "5"})
    return ReadyAnswer(status="ready")


@router.get(
    "/metrics",
    summary="Fetch the metrics",
    response_class=Response,
    responses=file_responses(("text/plain",), description="in Prometheus' text format"),
)
async def get_metrics(services: ServicesDep) -> Response:
    """For Prometheus: requests, jobs, runs, and how well the control loops kept their time."""
    return Response(await run_in_threadpool(services.metrics.text), headers={"content-type": CONTENT_TYPE})
