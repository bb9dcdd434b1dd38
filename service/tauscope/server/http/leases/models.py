"""Requests and answers about leases."""

from datetime import datetime
from typing import Any

from pydantic import Field

from tauscope.runtime.drivers import BackendName
from tauscope.server.control.leases import LONGEST_TTL_S
from tauscope.server.models import AnswerModel
from tauscope.strict_model import StrictModel


class LeaseRequest(StrictModel):
    """Which arm is wanted."""

    robot: str = Field(min_length=1, max_length=200, description="what the robot file calls the robot")
    backend: BackendName | None = Field(default=None, description="what moves it; null: the service's own")
    ttl_s: float = Field(
        default=10.0, ge=1.0, le=LONGEST_TTL_S, description="how long the lease lasts without a heartbeat [s]"
    )
    holder: str = Field(default="", max_length=100, description="who wants it, for others to read; default: the key")
    take: bool = Field(
        default=False, description="take the arm from whoever has its lease, and stop it; needs the scope admin"
    )


EXAMPLES: dict[str, tuple[str, Any]] = {
    "lease": ("An arm for ten seconds, and longer with heartbeats", {"robot": "two-joint-arm", "backend": "sim"}),
}


class LeaseLinks(AnswerModel):
    """What its holder does with a lease."""

    self_: str = Field(alias="self", description="the lease; DELETE gives it back")
    heartbeat: str = Field(description="where a POST is a sign of life")
    arm: str = Field(description="where a POST lets the arm move")
    disarm: str = Field(description="where a POST lets it move no more; what moves stops")


class LeaseAnswer(AnswerModel):
    """A lease that holds."""

    id: str = Field(description="identifier", examples=["lease-7"])
    number: int = Field(description="above that of every earlier lease since the service started")
    token: str | None = Field(
        default=None, description="what to send as header Lease-Token; told to whoever takes the lease, once"
    )
    arm: str = Field(description="the arm", examples=["two-joint-arm on sim"])
    holder: str = Field(description="who has it")
    armed: bool = Field(description="whether the arm may move")
    ttl_s: float = Field(description="how long it lasts without a heartbeat [s]")
    seconds_left: float = Field(description="how long it still lasts without a heartbeat [s]")
    links: LeaseLinks = Field(description="what its holder does with it")


class LeaseListAnswer(AnswerModel):
    """Leases that hold."""

    leases: list[LeaseAnswer] = Field(description="the newest first")


class StopAllAnswer(AnswerModel):
    """What was stopped."""

    runs: list[str] = Field(description="identifiers of the runs that were asked to stop")
    campaigns: list[str] = Field(description="identifiers of the campaigns that were asked to stop")
    time: datetime = Field(description="when, UTC")
