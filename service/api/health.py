"""Whether the service is there."""

from typing import Literal

from fastapi import APIRouter
from pydantic import Field

from service.api.models import AnswerModel
from service.jobs import tauscope_version

router = APIRouter(tags=["health"])


class HealthAnswer(AnswerModel):
    """The service is there."""

    status: Literal["ok"] = Field(description="always ok: a service that cannot answer does not")
    version: str = Field(description="of Tauscope", examples=["0.1.0"])


@router.get("/healthz", summary="Ask whether the service is there")
async def get_health() -> HealthAnswer:
    """Answers without touching the disk."""
    return HealthAnswer(status="ok", version=tauscope_version())
