"""Requests and answers about runs."""

from datetime import datetime
from typing import Any, Literal, Self

from pydantic import Field, JsonValue, model_validator
from pydantic_core import PydanticCustomError

from tauscope.runtime.options import RunOptions
from tauscope.runtime.real_time import RealTime
from tauscope.runtime.states import RunState
from tauscope.runtime.timing import Timing
from tauscope.server.http.backends import BackendRequest
from tauscope.server.http.robots.models import EXAMPLE_ROBOT
from tauscope.server.http.tasks.submission import RobotRequest
from tauscope.server.models import AnswerModel
from tauscope.server.problems import Problem
from tauscope.tasks.run import BackendChoice

RecordingFormat = Literal["mcap", "csv", "parquet"]


class RunRequest(RunOptions, RobotRequest, strict=True):
    """Which run is wanted."""

    backend: BackendRequest = Field(default=BackendRequest(), description="which arm is moved")
    excitation: str | None = Field(
        default=None,
        description="identifier of an excitation that succeeded; its robot is taken where none is sent; null, and no"
        " trajectory: the default motion is designed first",
    )
    trajectory: dict[str, Any] | None = Field(
        default=None, description="a trajectory document; in a form, the part `trajectory` may hold the file instead"
    )

    seed: int = Field(default=0, ge=0, lt=2**63, description="of the default motion")

    @model_validator(mode="after")
    def _check_motion(self) -> Self:
        """One motion at most."""
        if self.excitation is not None and self.trajectory is not None:
            raise PydanticCustomError("motions", "excitation and trajectory are both given; give one motion")
        return self


EXAMPLES: dict[str, tuple[str, Any]] = {
    "default": ("The default motion on the simulated arm", {"robot": EXAMPLE_ROBOT, "backend": {"name": "sim"}}),
    "options": (
        "The host closes the loop, 250 times a second, against the clock",
        {
            "robot": EXAMPLE_ROBOT,
            "backend": {"name": "sim", "time": "real"},
            "mode": "torque",
            "rate_hz": 250.0,
            "stop_policy": "damp",
        },
    ),
}


class RunLinks(AnswerModel):
    """Where to go on from a run."""

    self_: str = Field(alias="self", description="its state")
    events: str = Field(description="what happens to it, as server-sent events")
    stop: str = Field(description="where a POST stops it")
    excitation: str | None = Field(default=None, description="the excitation that it plays")
    recordings: dict[RecordingFormat, str] = Field(default={}, description="its recording by format, once there is one")


class RunRecordingAnswer(AnswerModel):
    """What a run left behind."""

    name: str | None = Field(description="by which identifications refer to it; null where it is not on the server")
    samples: int = Field(description="samples of the motion, without the ramp")
    partial: bool = Field(description="whether the motion was not played to its end, or samples were lost")
    lost_rows: int = Field(description="cycles that could not be written in time; -1 where nobody knows")
    remarks: tuple[str, ...] = Field(description="what is missing, and why")


class RunAnswer(AnswerModel):
    """The state of a run."""

    id: str = Field(description="identifier", examples=["20261103T101502Z-1f2e3d4c"])
    state: RunState | Literal["damaged"] = Field(
        description="where it stands; interrupted: the service ended first; damaged: its files are missing or damaged"
    )
    step: str | None = Field(default=None, description="what it waits for, before it moves")
    percent: float | None = Field(default=None, description="how much of ramp and motion was played")
    figures: dict[str, JsonValue] = Field(default={}, description="measured last, while it goes on")
    created: datetime | None = Field(default=None, description="when it was handed in, UTC")
    ended: datetime | None = Field(default=None, description="when it ended, UTC")
    robot: str | None = Field(default=None, description="name of the robot")
    backend: BackendChoice | None = Field(default=None, description="which arm is moved")
    options: RunOptions | None = Field(default=None, description="how it is run")
    campaign: str | None = Field(default=None, description="identifier of the campaign that it belongs to")
    stop_policy: str | None = Field(default=None, description="how the arm is stopped")
    ramp_s: float | None = Field(default=None, description="time from the first cycle to the motion's start")
    motion_s: float | None = Field(default=None, description="length of the motion")
    timing: Timing | None = Field(default=None, description="rate, jitter, missed and stale samples")
    real_time: RealTime | None = Field(default=None, description="what the control loop was given of what it asked for")
    worst_following: tuple[float, ...] = Field(
        default=(), description="largest distance of arm and target, one number a joint"
    )
    stop: str | None = Field(default=None, description="who asked for the stop; null where nobody did")
    problem: Problem | None = Field(default=None, description="why it did not finish")
    recording: RunRecordingAnswer | None = Field(default=None, description="what it left behind, once it has ended")
    links: RunLinks = Field(description="where to go on")


class RunListAnswer(AnswerModel):
    """Runs that are kept."""

    runs: list[RunAnswer] = Field(description="the newest first")


class StopAnswer(AnswerModel):
    """What became of the wish to stop a run."""

    id: str = Field(description="identifier of the run")
    state: RunState = Field(description="where the run stood; it stops unless that is an end state")
