"""Runs: requests, answers and what is special about this resource."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from typing import Annotated, Any, Literal, Self

from fastapi import Query
from fastapi.responses import FileResponse
from pydantic import Field, JsonValue, model_validator
from pydantic_core import PydanticCustomError
from starlette.concurrency import run_in_threadpool
from typing_extensions import override

from tauscope.errors import ExcitationError, NotFoundError
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RunRecord
from tauscope.runtime.states import RunState
from tauscope.runtime.timing import RealTime, Timing
from tauscope.server.control.leases import Permit
from tauscope.server.control.run import RunRequestRecord, RunWorkspace, await_design, ready_motion, take_trajectory
from tauscope.server.control.run_manager import run_recording_name
from tauscope.server.http.answers import AnswerModel, Identifier, MotionLinks, convert_problem, describe_damaged
from tauscope.server.http.bodies import PartRule, file_answer, to_json_text
from tauscope.server.http.excitations import EXCITATIONS
from tauscope.server.http.leases import permit_of
from tauscope.server.http.openapi import binary_part, file_responses
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.http.settings import Settings
from tauscope.server.http.tasks import submission
from tauscope.server.http.tasks.router import MovingResource
from tauscope.server.problems import Problem, ProblemError
from tauscope.server.queue.analyses import ExcitationOrder, ExcitationWorkspace
from tauscope.server.queue.received_files import check_trajectory
from tauscope.server.queue.task_job import submit_job
from tauscope.server.store.event_log import EventLog
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.run import BackendChoice

RecordingFormat = Literal["mcap", "csv", "parquet"]


class RunRequest(RunOptions, submission.RobotRequest, strict=True):
    """Which run is wanted."""

    backend: submission.BackendRequest = Field(default=submission.BackendRequest(), description="which arm is moved")
    excitation: str | None = Field(
        default=None,
        description="identifier of an excitation that succeeded; its robot is taken where none is sent; null, and no"
        " trajectory: the default motion is designed first",
    )
    trajectory: dict[str, Any] | None = Field(default=None, description="a trajectory document; in a form, also a part")

    seed: int = Field(default=0, ge=0, lt=2**63, description="of the default motion")

    @model_validator(mode="after")
    def _check_motion(self) -> Self:
        if self.excitation is not None and self.trajectory is not None:
            raise PydanticCustomError("motions", "excitation and trajectory are both given; give one motion")
        return self


EXAMPLES: dict[str, tuple[str, Any]] = {
    "default": (
        "The default motion on the simulated arm",
        {"robot": submission.EXAMPLE_ROBOT, "backend": {"name": "sim"}},
    ),
    "options": (
        "The host closes the loop, 250 times a second, against the clock",
        {
            "robot": submission.EXAMPLE_ROBOT,
            "backend": {"name": "sim", "time": "real"},
            "mode": "torque",
            "rate_hz": 250.0,
            "stop_policy": "damp",
        },
    ),
}


class RunLinks(MotionLinks):
    excitation: str | None = Field(default=None, description="the excitation that it plays")
    recordings: dict[RecordingFormat, str] = Field(default={}, description="its recording by format, once there is one")


class RunRecordingAnswer(AnswerModel):
    name: str | None = Field(description="by which identifications refer to it; null where it is not on the server")
    samples: int = Field(description="samples of the motion, without the ramp")
    partial: bool = Field(description="whether the motion was not played to its end, or samples were lost")
    lost_rows: int = Field(description="cycles that could not be written in time; -1 where nobody knows")
    remarks: tuple[str, ...] = Field(description="what is missing, and why")


class RunAnswer(AnswerModel):
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
    holds: bool | None = Field(default=None, description="whether the arm was powered at the end; null: unknown")
    drives: tuple[str, ...] = Field(default=(), description="what the drives lack, or what was changed in them")
    kept: float | None = Field(default=None, description="part of the motion's samples that was kept, 0 to 1")
    timing: Timing | None = Field(default=None, description="rate, jitter, missed and stale samples")
    real_time: RealTime | None = Field(default=None, description="what the control loop was given of what it asked for")
    worst_following: tuple[float, ...] = Field(default=(), description="largest distance of arm and target, by joint")
    stop: str | None = Field(default=None, description="who asked for the stop; null where nobody did")
    problem: Problem | None = Field(default=None, description="why it did not finish")
    recording: RunRecordingAnswer | None = Field(default=None, description="what it left behind, once it has ended")
    links: RunLinks = Field(description="where to go on")


class StopAnswer(AnswerModel):
    id: str = Field(description="identifier of the run")
    state: RunState = Field(description="where the run stood; it stops unless that is an end state")


FORMATS: tuple[RecordingFormat, ...] = ("mcap", "csv", "parquet")


@dataclass(frozen=True)
class FollowedRun:
    """A run as those see it who follow its events: it ends when the desk has put everything in its place."""

    events: EventLog
    has_ended: Callable[[], bool]


def require_recording(services: Services, identifier: str, format_: RecordingFormat) -> RunWorkspace:
    """A run that left a recording of a format. Raises NotFoundError, or ProblemError while it goes on."""
    workspace = RUNS.find(services, identifier)
    if not workspace.has_ended() or services.runs.live(identifier) is not None:
        text = f"{identifier} goes on; ask for its recording when its state is an end state"
        raise ProblemError("not-finished", text, headers={"Retry-After": "2"})
    if not workspace.recording(format_).is_file():
        have = [name for name in FORMATS if workspace.recording(name).is_file()]
        hint = f"there is {', '.join(have)}" if have else "it ended before the arm moved"
        raise NotFoundError(f"run {identifier} left no {format_}: {hint}")
    return workspace


def _links(here: str, excitation: str | None, record: RunRecord | None, workspace: RunWorkspace) -> RunLinks:
    has_ended = record is not None and record.state.is_end
    made: dict[RecordingFormat, str] = {
        name: f"{here}/recording?format={name}" for name in FORMATS if has_ended and workspace.recording(name).is_file()
    }
    return RunLinks(self=here, events=f"{here}/events", stop=f"{here}/stop", excitation=excitation, recordings=made)


LARGEST_TRAJECTORY = 64 * 2**20  # bytes of the largest trajectory file that is accepted


def _prepare(handed: submission.Submission[RunRequest]) -> tuple[RunRequestRecord, bool]:
    """What is asked for, and whether its trajectory was sent."""
    document, is_sent = handed.document, handed.form.file("trajectory") is not None
    if document.trajectory is not None:
        if is_sent:
            raise ProblemError("invalid-request", "the trajectory came twice, as a part and in part request; send one")
        text = to_json_text(document.trajectory, "trajectory", ExcitationError)
        (handed.workspace.trajectories / "trajectory.json").write_text(text, encoding="utf-8")
        is_sent = True
    if is_sent and document.excitation is not None:
        raise ProblemError("invalid-request", "excitation and trajectory were both given; give one motion")
    backend = submission.choose_backend(handed.services.settings, document.backend, handed.robot)
    order = RunRequestRecord(
        **handed.robot_fields,
        backend=backend,
        device=backend.device(handed.robot.name),
        excitation=document.excitation,
        options=RunOptions.model_validate(document.model_dump(include=set(RunOptions.model_fields))),
    )
    return order, is_sent


def _submit(
    order: RunRequestRecord, handed: submission.Submission[RunRequest], permit: Permit, *, is_sent: bool
) -> str:
    """Start a run; where there is no motion, one is designed first."""
    services, workspace = handed.services, handed.workspace
    kind, motion = services.kinds["excitation"], ready_motion
    services.runs.claims.require_free(order.device)
    if order.excitation is not None:
        take_trajectory(EXCITATIONS.finished(services, order.excitation), workspace)
    elif not is_sent:
        options = ExcitationDesignOptions(seed=handed.document.seed, following_error=order.options.following_error)
        design = ExcitationOrder(**handed.robot_fields, options=options)
        put_robot = partial(shutil.copytree, workspace.robot, dirs_exist_ok=True)
        identifier = submit_job(services.jobs, kind, ExcitationWorkspace, design, put_robot)
        order = order.model_copy(update={"excitation": identifier})
        motion = await_design(services.jobs, kind, identifier)
    workspace.write_order(order)
    try:
        return services.runs.submit(workspace.folder, motion, permit=permit)
    except BaseException:
        if motion is not ready_motion:
            services.jobs.cancel(kind, order.excitation or "")
        raise


Format = Annotated[RecordingFormat, Query(alias="format", description="mcap: the journal, ramp included; else columns")]


class Runs(MovingResource):
    @override
    def follow(self, services: Services, identifier: str) -> FollowedRun:
        workspace = self.find(services, identifier)
        return FollowedRun(workspace.events, lambda: services.runs.live(identifier) is None and workspace.has_ended())

    @override
    def describe(self, services: Services, identifier: str) -> RunAnswer:
        workspace, live, here = self.find(services, identifier), services.runs.live(identifier), self.path(identifier)
        record, request = workspace.read_record(), workspace.read_order()
        if record is None or request is None:
            return RunAnswer(**describe_damaged(identifier, here), links=_links(here, None, None, workspace))
        goes_on = live is not None and not record.state.is_end
        left, name = record.recording, run_recording_name(identifier)
        kept = name if services.recordings.holds(name) else None
        excitation = request.excitation and EXCITATIONS.path(request.excitation)
        return RunAnswer.describe(
            record,
            id=identifier,
            step=workspace.read_step() if goes_on else None,
            percent=live.percent if live is not None and goes_on else 100.0 * record.played,
            figures=dict(live.figures) if live is not None and goes_on else {},
            created=record.history[0].at,
            ended=record.history[-1].at if record.state.is_end else None,
            backend=request.backend,
            options=request.options,
            campaign=request.campaign,
            problem=convert_problem(workspace.problem(), here),
            recording=None if left is None else RunRecordingAnswer.describe(left, name=kept),
            links=_links(here, excitation, record, workspace),
        )

    @override
    def part_rules(self, settings: Settings, workspace: RunWorkspace) -> dict[str, PartRule]:
        most = min(LARGEST_TRAJECTORY, settings.max_upload_bytes)
        return {"trajectory": PartRule(most, workspace.trajectories, default_name="trajectory.json")}

    @override
    def put_robot(self, received: submission.Received[RunRequest], services: Services, workspace: RunWorkspace) -> str:
        document, has_robot = received.document, received.form.file("robot") or received.document.robot
        if document.excitation is None or has_robot:
            return super().put_robot(received, services, workspace)
        excitation = EXCITATIONS.finished(services, document.excitation)
        order = excitation.read_order()
        shutil.copytree(excitation.robot, workspace.robot, dirs_exist_ok=True)
        return "robot.yaml" if order is None else order.robot_file

    @override
    async def hand_over(self, handed: submission.Submission[RunRequest]) -> str:
        request, services, workspace = handed.request, handed.services, handed.workspace
        order, is_sent = await run_in_threadpool(_prepare, handed)
        permit = permit_of(request, services, order.device)
        if is_sent:
            robot_file = workspace.robot / handed.robot_file
            await services.reading.call(request, check_trajectory, workspace.trajectories, robot_file)
        return await run_in_threadpool(_submit, order, handed, permit, is_sent=is_sent)


RUNS = Runs(
    noun="a run",
    models=(RunRequest, RunAnswer),
    workspace=RunWorkspace,
    manager=lambda services: services.runs,
    examples=EXAMPLES,
    summary="Begin a run",
    words="The arm moves as soon as there is a motion: follow `Location` until it has ended, or stop it at any time."
    "\n\n"
    "One run at a time has an arm. Where somebody has the arm's lease, only they move it; it stops when the lease ends."
    "\nEvery command passes a guard that keeps the robot file's limits.",
    problems=("not-found", "not-finished", "excitation", "queue-full"),
    parts={"trajectory": binary_part("the motion: a trajectory document (.json), or samples (.csv)")},
    stop_model=StopAnswer,
    stop_words="Stops the arm by the run's stop policy; legal in every state, any number of times; needs no body.\n\n"
    "It waits for nothing: neither for other requests nor for jobs. The recording up to the stop is kept.",
    remove_words="One that has ended is removed with all its files; its recording stays among the recordings.",
)

router = RUNS.router()


@router.get(
    "/{identifier}/recording",
    name="get_recording_of_run",
    summary="Fetch the recording of a run",
    response_class=FileResponse,
    responses=file_responses(("application/octet-stream", "text/csv"), "not-found", "not-finished"),
)
def get_recording(identifier: Identifier, services: ServicesDep, format_: Format = "csv") -> FileResponse:
    """What was measured; also of a run that was stopped or interrupted, as far as it came."""
    workspace = require_recording(services, identifier, format_)
    return file_answer(workspace.recording(format_), f"run-{identifier}.{format_}")
