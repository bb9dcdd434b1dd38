"""The index over HTTP: items and robots, searched."""

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import AwareDatetime, Field

from tauscope.server.http.answers import ROOT, AnswerModel, Limit
from tauscope.server.http.services import ServicesDep
from tauscope.server.http.tasks.submission import RobotVersionAnswer
from tauscope.server.problems import problem_responses
from tauscope.server.store.data_folder import FOLDERS, ItemKind
from tauscope.server.store.database.index import ItemEntry, ItemQuery, RobotEntry


class ItemAnswer(AnswerModel):
    kind: str = Field(description="excitation, run, identification, diagnosis, rollout or campaign", examples=["run"])
    id: str = Field(description="identifier", examples=["20261103T101502Z-1f2e3d4c"])
    site: str = Field(description="identifier of the data folder that holds it")
    is_here: bool = Field(description="whether that is this service's own; only then `link` leads to it")
    link: str | None = Field(description="path of its resource")
    state: str = Field(description="where it stands; damaged: a file of it is missing, or is not what it was")
    robot: str | None = Field(description="name of the robot")
    created: datetime = Field(description="when it was handed in, UTC")
    ended: datetime | None = Field(description="when it ended, UTC")
    problem: str | None = Field(description="one line: why it has no result")
    figures: dict[str, str | float | None] = Field(
        description="of an identification relative_error and held_out_error, of a diagnosis verdict and headline, of"
        " a run backend"
    )


class ItemListAnswer(AnswerModel):
    items: list[ItemAnswer] = Field(description="the newest first")
    before: datetime | None = Field(description="to be given as `before` for the next ones; null where there are none")


class RobotListAnswer(AnswerModel):
    robots: list[RobotEntry] = Field(description="by name")
    versions: list[RobotVersionAnswer] = Field(description="robots that were sent to be kept, the newest first")


router = APIRouter(tags=["items"], responses=problem_responses("store"))
Kind = Annotated[ItemKind | None, Query(description="kind of item")]
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
    """Excitations, runs, identifications, diagnoses, rollouts and campaigns of every robot, damaged ones too.

    Where several services share a database, those of all data folders are found.
    """
    services.index.refresh()
    query = ItemQuery(kind, state, robot, None, recording_sha256, before, limit)
    found = [_answer(entry, services.index.index.site) for entry in services.index.index.search(query)]
    return ItemListAnswer(items=found, before=found[-1].created if len(found) == limit else None)


@router.get("/robots", tags=["robots"], summary="List the robots")
def list_robots(services: ServicesDep) -> RobotListAnswer:
    """Every robot that something is or was kept about; its name is the one in its file."""
    services.index.refresh()
    known = services.index.index.robots()
    return RobotListAnswer(robots=known, versions=[RobotVersionAnswer.of(each) for each in services.robots.versions()])


def _answer(entry: ItemEntry, site: str) -> ItemAnswer:
    is_here = entry.site == site
    link = f"{ROOT}/{FOLDERS[entry.kind]}/{entry.identifier}" if is_here else None
    return ItemAnswer.describe(entry, id=entry.identifier, is_here=is_here, link=link, problem=entry.problem_detail)
