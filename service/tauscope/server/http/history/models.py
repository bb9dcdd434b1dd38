"""Requests and answers about models over time."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from tauscope.server.models import AnswerModel, StrictModel


class ReasonRequest(StrictModel):
    """Why somebody decides something; kept with the decision."""

    reason: Annotated[str, Field(min_length=1, max_length=1000)] = Field(
        description="one line", examples=["gear oil changed on 3 November"]
    )


class GateAnswer(AnswerModel):
    """A condition for becoming the active model."""

    name: str = Field(description="held_out, consistency, excitation, structure, newer or source")
    passed: bool = Field(description="whether it is met")
    reason: str = Field(description="what was found, what is allowed, and what to do where it is not met")


class ModelLinksAnswer(AnswerModel):
    """Where to go on from a model."""

    self_: str = Field(alias="self", description="the model")
    document: str = Field(description="what it says: the identification's document")


class ModelAnswer(AnswerModel):
    """A model of a robot: an identification that was judged."""

    id: str = Field(description="identifier of the identification", examples=["20261103T101502Z-1f2e3d4c"])
    site: str = Field(description="identifier of the data folder that holds the identification")
    robot: str = Field(description="name of the robot")
    created: datetime = Field(description="when the identification was handed in, UTC")
    considered: datetime = Field(description="when it was judged, UTC")
    source: Literal["arm", "simulated", "uploaded"] = Field(description="what was measured")
    state: Literal["active", "kept", "refused", "unreadable"] = Field(
        description="active: in use; kept: was in use; refused: did not pass a gate; unreadable: its result is damaged"
    )
    is_reference: bool = Field(description="whether drift is counted from this model")
    gates: tuple[GateAnswer, ...] = Field(description="what it had to show")
    links: ModelLinksAnswer = Field(description="where to go on")


class ModelListAnswer(AnswerModel):
    """Models of a robot."""

    models: list[ModelAnswer] = Field(description="the newest first")


class DriftAnswer(AnswerModel):
    """The change of a parameter."""

    name: str = Field(description="of the parameter", examples=["viscous joint3"])
    joint: str = Field(description="that it belongs to")
    before: float = Field(description="in the model that it is compared with [SI]")
    after: float = Field(description="in this model [SI]")
    std: float = Field(description="standard error of the difference [SI]")
    in_std: float = Field(description="difference in standard errors")
    share: float = Field(description="difference in parts of the earlier value")


class ComparisonAnswer(AnswerModel):
    """One model compared with another."""

    before: str = Field(description="identifier of the model that it is compared with")
    after: str = Field(description="identifier of this model")
    parameters: list[DriftAnswer] = Field(description="every parameter that both tell")
    joints: dict[str, DriftAnswer] = Field(description="for each joint its most significant change")


class TrendPointAnswer(AnswerModel):
    """A parameter in one model."""

    time: datetime = Field(description="when its identification was handed in, UTC")
    value: float = Field(description="estimate [SI]")
    std: float = Field(description="its standard error [SI]")
    model: str = Field(description="identifier of the model")


class LineAnswer(AnswerModel):
    """The straight line through the points."""

    count: int = Field(description="number of points")
    slope: float = Field(description="change a week [SI]")
    slope_std: float = Field(description="its standard error, scatter of the points included [SI]")
    scatter: float = Field(description="1 where the points scatter as their standard errors say")
    change: float = Field(description="of the line from the first point to the last [SI]")
    in_std: float = Field(description="slope in its standard errors")


class ParameterTrendAnswer(AnswerModel):
    """A parameter over time."""

    name: str = Field(description="of the parameter")
    joint: str = Field(description="that it belongs to")
    points: list[TrendPointAnswer] = Field(description="in every model that was ever active, the oldest first")
    line: LineAnswer | None = Field(description="null before there are three points")


class TrendAnswer(AnswerModel):
    """Every parameter of a robot over time."""

    robot: str = Field(description="name of the robot")
    parameters: list[ParameterTrendAnswer] = Field(description="in the order of the newest model")


class EventAnswer(AnswerModel):
    """Something about a robot that people should know."""

    number: int = Field(description="of the event")
    robot: str = Field(description="name of the robot")
    kind: str = Field(description="drift", examples=["drift"])
    parameter: str = Field(description="that drifted")
    text: str = Field(
        description="one line",
        examples=["joint3: viscous friction +40 % in 6 weeks (0.5 → 0.7, 12 standard errors)"],
    )
    raised: datetime = Field(description="when it was seen first, UTC")
    last_seen: datetime = Field(description="when it was seen last, UTC")
    closed: datetime | None = Field(description="when somebody took note, UTC")
    note: str | None = Field(description="what they wrote")


class EventListAnswer(AnswerModel):
    """What people should know."""

    events: list[EventAnswer] = Field(description="the newest first")
