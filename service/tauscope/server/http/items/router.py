"""Routes that search what is kept."""

from datetime import datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Query
from pydantic import AwareDatetime

from tauscope.server.http.items import ItemAnswer, ItemListAnswer, KnownRobotAnswer, RobotListAnswer
from tauscope.server.http.services import ServicesDep
from tauscope.server.http.tasks.routes import Limit
from tauscope.server.problems import problem_responses
from tauscope.server.store.data_folder import FOLDERS
from tauscope.server.store.database.index import ItemEntry, ItemQuery

router = APIRouter(tags=["items"], responses=problem_responses("invalid-request", "store"))

Kind = Annotated[
    Literal["excitation", "run", "identification", "diagnosis", "campaign"] | None, Query(description="kind of item")
]
State = Annotated[str | None, Query(max_length=40, description="where it stands", examples=["succeeded", "damaged"])]
RobotName = Annotated[str | None, Query(max_length=1000, description="name of the robot")]
Digest = Annotated[
    str | None,
    Query(pattern="^[0-9a-f]{64}$", description="sha256 of a recording that the item was made from or judged by"),
]
Before = Annotated[AwareDatetime | None, Query(description="handed in earlier than this moment")]


@router.get("/items", summary="Search what is kept")
def search_items(
    services: ServicesDep,
    *,
    kind: Kind = None,
    state: State = None,
    robot: RobotName = None,
    recording_sha256: Digest = None,
    before: Before = None,
    limit: Limit = 100,
) -> ItemListAnswer:
    """Excitations, runs, identifications, diagnoses and campaigns of every robot, damaged ones too.

    Where several services share a database, those of all data folders are found.
    """
    services.index.sync()
    query = ItemQuery(kind, state, robot, None, recording_sha256, before, limit)
    found = [_answer(entry, services.index.index.site) for entry in services.index.index.search(query)]
    return ItemListAnswer(items=found, before=_next(found, limit))


@router.get("/robots", tags=["robots"], summary="List the robots")
def list_robots(services: ServicesDep) -> RobotListAnswer:
    """Every robot that something is or was kept about; its name is the one in its file."""
    services.index.sync()
    return RobotListAnswer(robots=[KnownRobotAnswer.model_validate(each) for each in services.index.index.robots()])


def _next(found: list[ItemAnswer], limit: int) -> datetime | None:
    """Where the next page begins."""
    return found[-1].created if len(found) == limit else None


def _answer(entry: ItemEntry, site: str) -> ItemAnswer:
    """The answer that holds an item."""
    is_here = entry.site == site
    return ItemAnswer(
        kind=entry.kind,
        id=entry.identifier,
        site=entry.site,
        is_here=is_here,
        link=f"/api/v1/{FOLDERS[entry.kind]}/{entry.identifier}" if is_here else None,
        state=entry.state,
        robot=entry.robot,
        created=entry.created,
        ended=entry.ended,
        problem=entry.problem_detail,
        figures=dict(entry.figures),
    )
