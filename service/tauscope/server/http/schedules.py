"""Schedules over HTTP: set up, changed, run now, and their firings."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import APIRouter, Path
from pydantic import Field

from tauscope.server.http.answers import ROOT, AnswerModel, Limit
from tauscope.server.http.history import ReasonRequest
from tauscope.server.http.openapi import takes_document
from tauscope.server.http.services import ServicesDep, document_of
from tauscope.server.problems import problem_responses
from tauscope.server.schedules.definition import ScheduleDefinition
from tauscope.server.schedules.repository import FiringEntry
from tauscope.server.schedules.scheduler import make_schedule, read_definition
from tauscope.server.store.data_folder import FOLDERS, utc_now
from tauscope.server.store.database.tables import Schedule
from tauscope.strict_model import StrictModel


class ScheduleRequest(StrictModel):
    """What is to be repeated, and when."""

    like: Annotated[str, Field(max_length=100)] = Field(
        description="identifier of a campaign, an identification or a diagnosis of this service: its robot and its"
        " options are repeated",
        examples=["20261103T101502Z-1f2e3d4c"],
    )
    anywhere: bool = Field(default=False, description="whether any service of the database may do it, or this one")
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
    name: str = Field(description="of it")
    site: str | None = Field(description="data folder whose service does it; null: whichever comes first")
    robot: str | None = Field(description="name of the robot")
    definition: ScheduleDefinition = Field(description="when it is due")
    created: datetime = Field(description="when it was set up first, UTC")
    next_due: datetime | None = Field(description="when it is due next, UTC; null while it is not enabled")
    firings: str = Field(description="path of its firings")


class ScheduleListAnswer(AnswerModel):
    schedules: list[ScheduleAnswer] = Field(description="by name")


class FiringAnswer(AnswerModel):
    number: int = Field(description="of the firing")
    due: datetime = Field(description="when it was, UTC")
    is_asked: bool = Field(description="whether somebody asked for it")
    state: str = Field(description="asked, claimed, started, skipped, missed, failed, interrupted or withdrawn")
    reason: str | None = Field(description="why nothing was started")
    item: str | None = Field(description="path of what was started, as on the service that started it")
    item_state: str | None = Field(description="where that stands, as far as the index knows")


class FiringListAnswer(AnswerModel):
    firings: list[FiringAnswer] = Field(description="the newest first")


router = APIRouter(prefix="/schedules", tags=["schedules"], responses=problem_responses("store"))
Name = Annotated[str, Path(pattern="^[a-z0-9][a-z0-9-]{0,62}$", description="its name", examples=["cell3-nightly"])]


@router.get("", summary="List schedules")
def list_schedules(services: ServicesDep) -> ScheduleListAnswer:
    """Those of every service that shares the database."""
    entries = services.schedules.repository.schedules()
    return ScheduleListAnswer(schedules=[_answer(entry) for entry in entries])


@router.put(
    "/{name}", summary="Set a schedule up, or change it", **takes_document(ScheduleRequest, EXAMPLES, "not-found")
)
def put_schedule(
    body: Annotated[ScheduleRequest, document_of(ScheduleRequest)], name: Name, services: ServicesDep
) -> ScheduleAnswer:
    """It repeats something that was done once. What is due while no service runs is made up for once, or passed over.

    Nothing is started outside of its window, while what it started last goes on, while somebody else has the arm, or
    where the interlock objects; such a firing is skipped, and never repeated by itself.
    """
    scheduler = services.schedules
    site = None if body.anywhere else scheduler.repository.site
    scheduler.repository.put(make_schedule(name, body.like, body.definition, scheduler.repeater, site, utc_now()))
    return _answer(scheduler.repository.find(name))


@router.get("/{name}", summary="Look a schedule up", responses=problem_responses("not-found"))
def get_schedule(name: Name, services: ServicesDep) -> ScheduleAnswer:
    """What is repeated, and when it is due next."""
    return _answer(services.schedules.repository.find(name))


@router.delete("/{name}", status_code=204, summary="Remove a schedule", responses=problem_responses("not-found"))
def remove_schedule(name: Name, services: ServicesDep) -> None:
    """Its firings are forgotten; what they started stays."""
    services.schedules.repository.remove(name)


@router.get("/{name}/firings", summary="List the firings of a schedule", responses=problem_responses("not-found"))
def list_firings(name: Name, services: ServicesDep, limit: Limit = 100) -> FiringListAnswer:
    """Every time that it was due, what was started, and why nothing was."""
    services.index.refresh()
    return FiringListAnswer(firings=[_firing(each) for each in services.schedules.repository.firings(name, limit)])


@router.post(
    "/{name}/run",
    status_code=202,
    summary="Do what a schedule does now",
    dependencies=[document_of(ReasonRequest)],
    **takes_document(ReasonRequest, {"why": ("Why", {"reason": "a test"})}, "not-found"),
)
def run_schedule(name: Name, services: ServicesDep) -> FiringAnswer:
    """As if it were due: window, interlock and whatever goes on are looked at. The service of its site does it."""
    return _firing(services.schedules.fire_now(name))


def _answer(entry: Schedule) -> ScheduleAnswer:
    robot = entry.order.get("robot_name")
    return ScheduleAnswer.describe(
        entry,
        robot=robot if isinstance(robot, str) else None,
        definition=read_definition(entry),
        firings=f"{ROOT}/schedules/{entry.name}/firings",
    )


def _firing(entry: FiringEntry) -> FiringAnswer:
    item = None if entry.item is None else f"{ROOT}/{FOLDERS[entry.item[0]]}/{entry.item[1]}"
    return FiringAnswer.describe(entry, item=item)
