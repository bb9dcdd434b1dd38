"""Answers about what is kept."""

from datetime import datetime

from pydantic import Field

from tauscope.server.models import AnswerModel


class ItemAnswer(AnswerModel):
    """Something that is kept, as a search finds it."""

    kind: str = Field(description="excitation, run, identification, diagnosis or campaign", examples=["run"])
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
        description="of an identification relative_error and held_out_error, of a diagnosis verdict, of a run backend"
    )


class ItemListAnswer(AnswerModel):
    """What a search found."""

    items: list[ItemAnswer] = Field(description="the newest first")
    before: datetime | None = Field(description="to be given as `before` for the next ones; null where there are none")


class KnownRobotAnswer(AnswerModel):
    """A robot that something is kept about."""

    name: str = Field(description="as in its file")
    first_seen: datetime = Field(description="when the first item about it was handed in, UTC")
    last_seen: datetime = Field(description="when the last one was, UTC")


class RobotListAnswer(AnswerModel):
    """Robots that something is kept about."""

    robots: list[KnownRobotAnswer] = Field(description="by name")
