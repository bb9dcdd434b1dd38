"""Requests and answers about excitations."""

from typing import Any

from pydantic import Field

from tauscope.server.http.robots.models import EXAMPLE_ROBOT
from tauscope.server.http.tasks.answers import JobAnswer
from tauscope.server.http.tasks.submission import RobotRequest
from tauscope.server.models import AnswerModel
from tauscope.tasks.design_excitation import ExcitationDesignOptions


class ExcitationRequest(RobotRequest):
    """Which motion is wanted."""

    options: ExcitationDesignOptions = Field(
        default=ExcitationDesignOptions(), description="how the motion is designed"
    )


EXAMPLES: dict[str, tuple[str, Any]] = {
    "default": ("The default motion", {"robot": EXAMPLE_ROBOT}),
    "floor": (
        "Shorter periods, above a floor",
        {"robot": EXAMPLE_ROBOT, "options": {"duration_s": 8.0, "harmonics": 4, "periods": 6, "floor_m": -0.3}},
    ),
}


class ExcitationLinks(AnswerModel):
    """Where to go on from an excitation."""

    self_: str = Field(alias="self", description="its state")
    events: str = Field(description="what happens to it, as server-sent events")
    result: str | None = Field(default=None, description="its document, once it succeeded")
    trajectory: str | None = Field(default=None, description="its trajectory, once it succeeded")


class ExcitationAnswer(JobAnswer):
    """The state of an excitation."""

    robot: str | None = Field(default=None, description="name of the robot")
    options: ExcitationDesignOptions | None = Field(default=None, description="how the motion is designed")
    links: ExcitationLinks = Field(description="where to go on")


class ExcitationListAnswer(AnswerModel):
    """Excitations that are kept."""

    excitations: list[ExcitationAnswer] = Field(description="the newest first")
