"""Requests and answers about campaigns."""

from typing import Any, Literal

from pydantic import Field

from tauscope.diagnosis import DiagnosisDocument
from tauscope.identification import IdentificationDocument
from tauscope.server.http.backends import BackendRequest
from tauscope.server.http.robots.models import EXAMPLE_ROBOT
from tauscope.server.http.tasks.answers import JobAnswer
from tauscope.server.http.tasks.submission import RobotRequest
from tauscope.server.models import AnswerModel
from tauscope.server.queue.states import JobState
from tauscope.tasks.campaign import CampaignOptions
from tauscope.tasks.run import BackendChoice


class CampaignRequest(RobotRequest, CampaignOptions):
    """Which campaign is wanted."""

    backend: BackendRequest = Field(default=BackendRequest(), description="which arm is moved")


EXAMPLES: dict[str, tuple[str, Any]] = {
    "default": ("Everything as it comes, on the simulated arm", {"robot": EXAMPLE_ROBOT, "backend": {"name": "sim"}}),
    "options": (
        "Ordinary least squares from eight periods, without a held-out motion",
        {
            "robot": EXAMPLE_ROBOT,
            "backend": {"name": "sim", "time": "virtual"},
            "excitation": {"periods": 8, "seed": 3},
            "held_out": None,
            "identification": {"estimator": "ls"},
        },
    ),
}


class CampaignStepAnswer(AnswerModel):
    """One step of a campaign."""

    name: Literal["design", "run", "held-out design", "held-out run", "identify", "diagnose"] = Field(
        description="of the step"
    )
    state: str = Field(description="waiting, or the state of its excitation, run, identification or diagnosis")
    link: str | None = Field(default=None, description="its excitation, run, identification or diagnosis")


class CampaignLinksAnswer(AnswerModel):
    """Where to go on from a campaign."""

    self_: str = Field(alias="self", description="its state")
    events: str = Field(description="what happens to it, as server-sent events")
    stop: str = Field(description="where a POST stops it")
    recordings: tuple[str, ...] = Field(default=(), description="recordings that the model is made from")
    held_out: tuple[str, ...] = Field(default=(), description="recordings that it is judged by")
    identification: str | None = Field(default=None, description="its identification, exports included")
    diagnosis: str | None = Field(default=None, description="its diagnosis, where one was asked for")
    result: str | None = Field(default=None, description="its result, once it succeeded")


class CampaignAnswer(JobAnswer):
    """The state of a campaign."""

    robot: str | None = Field(default=None, description="name of the robot")
    backend: BackendChoice | None = Field(default=None, description="which arm is moved")
    steps: tuple[CampaignStepAnswer, ...] = Field(default=(), description="in their order")
    links: CampaignLinksAnswer = Field(description="where to go on")


class CampaignListAnswer(AnswerModel):
    """Campaigns that are kept."""

    campaigns: list[CampaignAnswer] = Field(description="the newest first")


class CampaignResult(AnswerModel):
    """What came of a campaign."""

    schema_: Literal["tauscope.campaign/1"] = Field(
        default="tauscope.campaign/1", alias="schema", description="name and version of this form"
    )
    identification: IdentificationDocument = Field(description="the same document as `tauscope identify --json`")
    diagnosis: DiagnosisDocument | None = Field(
        default=None, description="the same document as `tauscope diagnose --json`, where one was asked for"
    )
    steps: tuple[CampaignStepAnswer, ...] = Field(description="how it came about")
    links: CampaignLinksAnswer = Field(description="everything that was made on the way")


class CampaignStopAnswer(AnswerModel):
    """What became of the wish to stop a campaign."""

    id: str = Field(description="identifier of the campaign")
    state: JobState = Field(description="where it stood; it stops unless that is an end state")
