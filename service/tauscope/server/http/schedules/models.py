"""Requests and answers about schedules."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import Field

from tauscope.server.models import AnswerModel, StrictModel
from tauscope.server.schedules.definition import ScheduleDefinition


class ScheduleRequest(StrictModel):
    """What is to be repeated, and when."""

    like: Annotated[str, Field(max_length=100)] = Field(
        description="identifier of a campaign, an identification or a diagnosis of this service: its robot and its"
        " options are repeated",
        examples=["20261103T101502Z-1f2e3d4c"],
    )
    anywhere: bool = Field(
        default=False, description="whether any service of the same database may do it; else only this one"
    )
    definition: ScheduleDefinition = Field(description="when it is due")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "nightly": (
        "A campaign every weekday at two o'clock at night",
        {
            "like": "20261103T101502Z-1f2e3d4c",
            "definition": {
                "kind": "campaign",
                "cron": "0 2 * * mon-fri",
                "timezone": "Europe/Berlin",
                "window": {"start": "22:00", "end": "05:00"},
                "interlock": "cell3-free",
            },
        },
    ),
    "hourly": (
        "An identification every hour in which there is a new recording",
        {
            "like": "20261103T101502Z-1f2e3d4c",
            "definition": {"kind": "identification", "every_s": 3600, "recordings": {"pattern": "cell3-*.csv"}},
        },
    ),
}


class ScheduleAnswer(AnswerModel):
    """A schedule."""

    name: str = Field(description="of it")
    site: str | None = Field(description="data folder whose service does it; null: whichever comes first")
    robot: str | None = Field(description="name of the robot")
    definition: ScheduleDefinition = Field(description="when it is due")
    created: datetime = Field(description="when it was set up first, UTC")
    next_due: datetime | None = Field(description="when it is due next, UTC; null while it is not enabled")
    firings: str = Field(description="path of its firings")


class ScheduleListAnswer(AnswerModel):
    """All schedules."""

    schedules: list[ScheduleAnswer] = Field(description="by name")


class FiringAnswer(AnswerModel):
    """One time that a schedule was due."""

    number: int = Field(description="of the firing")
    due: datetime = Field(description="when it was, UTC")
    is_asked: bool = Field(description="whether somebody asked for it")
    state: str = Field(
        description="asked, claimed, started, skipped, missed, failed, interrupted or withdrawn; nothing is repeated"
    )
    reason: str | None = Field(description="why nothing was started")
    item: str | None = Field(description="path of what was started, as on the service that started it")
    item_state: str | None = Field(description="where that stands, as far as the index knows")


class FiringListAnswer(AnswerModel):
    """Firings of a schedule."""

    firings: list[FiringAnswer] = Field(description="the newest first")
