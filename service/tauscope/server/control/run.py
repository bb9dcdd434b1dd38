"""Runs: what is asked for, what their folder holds, their motion, and how their control process is started."""

import json
import shutil
import threading
import zlib
from collections.abc import Callable
from datetime import UTC
from pathlib import Path
from typing import Any, Literal

from pydantic import Field
from typing_extensions import override

from tauscope.errors import AcquisitionError
from tauscope.runtime.drivers import find_driver
from tauscope.runtime.loop import Report
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RUN_FILE, RunProblem, RunRecord, new_record, read_record, write_record
from tauscope.runtime.run_process import RunProcess, recover_run
from tauscope.runtime.states import RunState
from tauscope.server.queue import job_folder
from tauscope.server.queue.analyses import ExcitationWorkspace
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.queue.task_job import TaskWorkspace
from tauscope.strict_model import StrictModel
from tauscope.tasks import run
from tauscope.tasks.run import BackendChoice, recording_file
from tauscope.tasks.task import Files


class RunRequestRecord(StrictModel):
    form: Literal["tauscope.run-request/1"] = "tauscope.run-request/1"
    robot_file: str = Field(description="name of the robot file in the run's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")
    backend: BackendChoice = Field(default=BackendChoice(), description="which arm is moved")
    device: str = Field(description="names the arm: one run at a time has it")
    excitation: str | None = Field(default=None, description="excitation that is played; null: a motion from elsewhere")
    campaign: str | None = Field(default=None, description="identifier of the campaign that it belongs to")
    options: RunOptions = Field(default=RunOptions(), description="how it is run")


class RunWorkspace(job_folder.JobFolder[RunRequestRecord]):
    """Input, and the folder ``control/`` of the control process; before there is one the record stands beside it."""

    order_type = RunRequestRecord
    order_name = "request.json"

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.trajectories = folder / "trajectory"
        self.control = folder / "control"
        self.scenario = folder / "scenario.json"

    @override
    def prepare(self) -> None:
        super().prepare()
        self.trajectories.mkdir()

    @property
    def trajectory(self) -> Path | None:
        return next(iter(sorted(self.trajectories.glob("*"))), None)

    def recording(self, format_: str) -> Path:
        """Where the recording of a format lies; the journal is the MCAP, ramp included."""
        return recording_file(self.control, format_)

    def create(self, request: RunRequestRecord) -> None:
        backend, mode = request.backend.name, request.options.mode.value
        write_record(self.folder, new_record(request.robot_name, backend, mode))

    @override
    def read_record(self) -> RunRecord | None:
        try:
            return read_record(self.control if self._has_begun else self.folder)
        except AcquisitionError:
            return None

    def end_before_start(self, state: RunState, problem: RunProblem | None) -> None:
        """Write the end of a run that no control process was started for. Raises OSError if it cannot be written."""
        record = self.read_record()
        if record is None or record.state.is_end or self._has_begun:
            return
        write_record(self.folder, record.moved(RunState.STOPPING).moved(state, problem=problem))

    def recover(self) -> None:
        """Interrupt a run that nobody carries out. Raises AcquisitionError if its control process does not end."""
        if self._has_begun:
            recover_run(self.control)
            return
        detail = "the service ended before this run began; hand it in again"
        self.end_before_start(RunState.INTERRUPTED, RunProblem(code="interrupted", detail=detail))

    def problem(self) -> job_folder.JobProblem | None:
        """Why the run did not finish, without the server's folders; None where nothing is known against it."""
        record = self.read_record()
        if record is None or record.problem is None:
            return None
        return job_folder.JobProblem(code=record.problem.code, detail=self.in_user_terms(record.problem.detail))

    def in_user_terms(self, text: str) -> str:
        return job_folder.without_folders(text, self.control, self.trajectories, self.robot, self.folder)

    def tell_end(self) -> None:
        record = self.read_record()
        if record is not None and record.state.is_end and not self.has_told_end():
            time = record.history[-1].at.astimezone(UTC)
            self.tell(job_folder.EndedEvent(time=time, state=record.state, problem=self.problem()))

    @property
    def _has_begun(self) -> bool:
        return (self.control / RUN_FILE).exists()


def start_control(workspace: RunWorkspace, report: Report, *, sim_socket: Path | None = None) -> RunProcess:
    """Start the control process. Raises RobotFileError or AcquisitionError if files are damaged or it cannot start."""
    order, trajectory = workspace.read_order(), workspace.trajectory
    if order is None or trajectory is None:
        raise AcquisitionError("files of the run are missing or damaged; hand it in again")
    if "scenario" in find_driver(order.backend.name).option_names:  # the noise of a scenario is this run's own
        scenario = {"seed": zlib.crc32(workspace.folder.name.encode()), **(order.backend.scenario or {})}
        workspace.scenario.write_text(json.dumps(scenario, ensure_ascii=False), encoding="utf-8")
    request = run.Request(
        robot=str(workspace.robot / order.robot_file),
        backend=order.backend,
        scenario=str(workspace.scenario),
        options=order.options,
    )
    return run.start(
        request, Files(), trajectory, workspace.control, report, sim_socket=sim_socket, beats_by_itself=False
    )


Motion = Callable[[RunWorkspace, threading.Event], bool]
"""Sees to it that a run has its trajectory; False where the event, which asks to stop, came first.

Raises TauscopeError where there is none.
"""
POLL_S = 0.05  # how often the state of a job is looked at by whoever waits for it [s]


def ready_motion(run: RunWorkspace, stop: threading.Event) -> bool:
    return run.trajectory is not None and not stop.is_set()


def await_design(jobs: JobQueue, excitations: JobKind, excitation: str) -> Motion:
    """The motion that a job designs meanwhile. Raises TauscopeError, when it is needed, if the job has no result."""

    def fetch(run: RunWorkspace, stop: threading.Event) -> bool:
        design = ExcitationWorkspace(excitations.items.folder(excitation))
        run.write_step("design the motion")
        record = wait_for_end(design, stop)
        if record is None:
            jobs.cancel(excitations, excitation)
            return False
        require_succeeded(record, f"excitation {excitation}")
        take_trajectory(design, run)
        return True

    return fetch


def wait_for_end(workspace: job_folder.Workspace, stop: threading.Event) -> job_folder.JobRecord | None:
    """The end of a job, None where `stop` came first. Raises AcquisitionError if it was removed or is damaged."""
    while not stop.is_set():
        record = workspace.read_record()
        if record is None:
            raise AcquisitionError(f"job {workspace.folder.name} was removed or is damaged; begin anew")
        if record.state.is_end:
            return record
        stop.wait(POLL_S)
    return None


class StepFailedError(AcquisitionError):
    """Something that others wait for has ended without result."""

    def __init__(self, problem: job_folder.JobProblem) -> None:
        super().__init__(problem.detail)
        self.problem = problem


def require_succeeded(record: job_folder.JobRecord, name: str) -> None:
    """Refuse to go on without a result. Raises StepFailedError with the problem that the job ended in."""
    if record.state is not job_folder.JobState.SUCCEEDED:
        problem = record.problem or job_folder.JobProblem(code="internal", detail="it has no result")
        raise StepFailedError(problem.model_copy(update={"detail": f"{name}: {problem.detail}"}))


def take_trajectory(excitation: TaskWorkspace[Any], run: RunWorkspace) -> None:
    """Copy the trajectory of an excitation. Raises AcquisitionError if it is not there any more."""
    try:
        shutil.copyfile(excitation.trajectory, run.trajectories / excitation.trajectory.name)
    except FileNotFoundError:
        text = f"excitation {excitation.folder.name}: its trajectory is missing; have it designed again"
        raise AcquisitionError(text) from None
