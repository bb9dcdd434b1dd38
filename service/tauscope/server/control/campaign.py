"""Campaigns: their order and folder, one runner each, and the manager that starts, stops and removes them."""

import logging
import shutil
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from tauscope.errors import NotFoundError, TauscopeError
from tauscope.runtime.record import RunRecord
from tauscope.runtime.states import RunState
from tauscope.server.control.leases import FREE, Permit
from tauscope.server.control.run import (
    RunRequestRecord,
    RunWorkspace,
    StepFailedError,
    ready_motion,
    require_succeeded,
    take_trajectory,
    wait_for_end,
)
from tauscope.server.control.run_manager import Manager, RunManager, run_recording_name
from tauscope.server.queue import analyses
from tauscope.server.queue.job_folder import JobProblem, JobRecord, JobState, StoppedError, Workspace
from tauscope.server.queue.queue import CANCELLED, INTERNAL, INTERRUPTED, JobKind, JobQueue, QueueFullError
from tauscope.server.queue.task_job import Order, TaskWorkspace, order_kept, stage_workspace, submit_job
from tauscope.server.store.data_folder import ItemStore, staged_identifier
from tauscope.server.store.files import read_stored, write_stored
from tauscope.server.store.recordings import RecordingStore
from tauscope.strict_model import StrictModel
from tauscope.tasks.campaign import CampaignOptions, backend_of_run
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.run import BackendChoice


class CampaignOrder(CampaignOptions):
    form: Literal["tauscope.campaign-order/1"] = "tauscope.campaign-order/1"
    robot_file: str = Field(description="name of the robot file in the campaign's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")
    backend: BackendChoice = Field(default=BackendChoice(), description="which arm is moved")


class CampaignLinks(StrictModel):
    excitation: str | None = Field(default=None, description="identifier of the training motion")
    held_out_excitation: str | None = Field(default=None, description="identifier of the held-out motion")
    run: str | None = Field(default=None, description="identifier of the training run")
    held_out_run: str | None = Field(default=None, description="identifier of the held-out run")
    identification: str | None = Field(default=None, description="identifier of the identification")
    diagnosis: str | None = Field(default=None, description="identifier of the diagnosis")
    recordings: tuple[str, ...] = Field(default=(), description="recordings that the model is made from")
    held_out: tuple[str, ...] = Field(default=(), description="recordings that it is judged by")


class CampaignWorkspace(Workspace[CampaignOrder]):
    order_type = CampaignOrder

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._made = folder / "made.json"

    def read_made(self) -> CampaignLinks:
        return read_stored(self._made, CampaignLinks) or CampaignLinks()

    def record_made(self, **made: object) -> None:
        write_stored(self._made, self.read_made().model_copy(update=made))


_log = logging.getLogger("tauscope.jobs")
POLL_S = 0.2  # how often the progress of a run is told [s]
RETRY_S = 0.5  # how often a queue, or a disk, that is full is asked again [s]


@dataclass(frozen=True, eq=False)
class CampaignDependencies:
    jobs: JobQueue
    kinds: Mapping[str, JobKind]
    runs: RunManager
    recordings: RecordingStore


class CampaignRunner:
    """One campaign on its way. `stop` takes no lock and touches no disk, and stops the arm first."""

    def __init__(
        self,
        workspace: CampaignWorkspace,
        order: CampaignOrder,
        dependencies: CampaignDependencies,
        release_arm: Callable[[], None],
        permit: Permit = FREE,
    ) -> None:
        self.state = JobState.QUEUED
        self._workspace, self._order, self._dependencies = workspace, order, dependencies
        self._release_arm, self._permit = release_arm, permit
        self._robot: dict[str, Any] = {"robot_file": order.robot_file, "robot_name": order.robot_name}
        self._run_identifier: str | None = None
        self._stop_requested = threading.Event()
        self._is_closing = False

    def stop(self) -> None:
        """Stop the campaign, in whatever step it is; the arm has to be armed again before it moves again."""
        self._permit.disarm()
        self._stop_requested.set()
        # Whoever begins a run looks at the flag after it has told us of the run.
        run = self._run_identifier
        if run is not None:
            self._dependencies.runs.stop(run)

    def interrupt(self) -> None:
        """Stop because the service ends: what is left of the analysis is done after the next start."""
        self._is_closing = True
        self.stop()

    def run(self) -> None:
        """Take the campaign to its end; never raises."""
        self._move(JobState.RUNNING)
        try:
            end = self._run_to_end()
        finally:
            self._release_arm()
        # a disk that is full now may take it later; else it becomes `interrupted` with the next start
        while end is not None and not self._move(*end) and not self._is_closing:
            threading.Event().wait(RETRY_S)

    def _run_to_end(self) -> tuple[JobState, JobProblem | None] | None:
        """How it ended; None where it goes on after the next start."""
        try:
            self._run_steps()
        except StoppedError:
            if self._is_closing and self._workspace.read_made().recordings:
                return None  # the job that is in the queue goes on then, too
            self._cancel_jobs()
            if self._is_closing:
                return JobState.INTERRUPTED, INTERRUPTED
            return JobState.CANCELLED, CANCELLED
        except StepFailedError as error:
            return JobState.FAILED, error.problem
        except TauscopeError as error:
            return JobState.FAILED, JobProblem(code=error.code, detail=str(error))
        except Exception:
            _log.exception("campaign %s failed for an unforeseen reason", self._workspace.folder.name)
            return JobState.FAILED, INTERNAL
        return JobState.SUCCEEDED, None

    def _run_steps(self) -> None:
        made, order = self._workspace.read_made(), self._order
        if not made.recordings:
            self._begin("design the motion")
            excitation = self._design(order.training_options(), "excitation")
            held_out_options = order.held_out_options()
            held_out = held_out_options and self._design(held_out_options, "held_out_excitation")
            self._wait("excitation", excitation)
            self._begin("run the motion")
            recordings = (self._run_motion(excitation, "run"),)
            judges: tuple[str, ...] = ()
            if held_out:
                self._begin("design the held-out motion")
                self._wait("excitation", held_out)
                self._begin("run the held-out motion")
                judges = (self._run_motion(held_out, "held_out_run"),)
            self._workspace.record_made(recordings=recordings, held_out=judges)
        self._release_arm()
        self._begin("identify")
        self._analyse("identification", analyses.IdentificationWorkspace, order.identification)
        if order.diagnosis is not None:
            self._begin("diagnose")
            self._analyse("diagnosis", analyses.DiagnosisWorkspace, order.diagnosis)

    def _design(self, options: ExcitationDesignOptions, link: str) -> str:
        order = analyses.ExcitationOrder(**self._robot, options=options)
        identifier = self._submit(analyses.ExcitationWorkspace, order)
        self._workspace.record_made(**{link: identifier})
        return identifier

    def _submit(self, workspace: type[TaskWorkspace[Order]], order: Order) -> str:
        kind = self._dependencies.kinds[workspace.noun]
        while True:
            try:
                return submit_job(self._dependencies.jobs, kind, workspace, order, self._put_robot)
            except QueueFullError:
                if self._stop_requested.wait(RETRY_S):
                    raise StoppedError from None

    def _put_robot(self, folder: Path) -> None:
        shutil.copytree(self._workspace.robot, folder, dirs_exist_ok=True)

    def _wait(self, noun: str, identifier: str) -> None:
        record = wait_for_end(self._job(noun, identifier), self._stop_requested)
        if record is None:
            raise StoppedError
        require_succeeded(record, f"{noun} {identifier}")

    def _run_motion(self, excitation: str, link: str) -> str:
        order, dependencies = self._order, self._dependencies
        request = RunRequestRecord(
            **self._robot,
            backend=backend_of_run(order.backend, held_out=link == "held_out_run"),
            device=order.backend.device(order.robot_name),
            excitation=excitation,
            campaign=self._workspace.folder.name,
            options=order.run,
        )
        with stage_workspace(dependencies.runs.items, RunWorkspace) as staged:
            self._put_robot(staged.robot)
            design = analyses.ExcitationWorkspace(dependencies.kinds["excitation"].items.folder(excitation))
            take_trajectory(design, staged)
            staged.write_order(request)
            holder = f"campaign {self._workspace.folder.name}"
            self._run_identifier = dependencies.runs.submit(staged.folder, ready_motion, holder, self._permit)
        self._workspace.record_made(**{link: self._run_identifier})
        if self._stop_requested.is_set():
            dependencies.runs.stop(self._run_identifier)
        self._follow(self._run_identifier)
        record = RunWorkspace(dependencies.runs.items.folder(self._run_identifier)).read_record()
        if record is None or record.state is not RunState.FINISHED:
            if self._stop_requested.is_set():
                raise StoppedError
            raise StepFailedError(_run_problem(self._run_identifier, record))
        name, self._run_identifier = run_recording_name(self._run_identifier), None
        return name

    def _follow(self, run: str) -> None:
        told = None
        while (live := self._dependencies.runs.live(run)) is not None:
            if live.percent is not None and live.percent != told:
                told = live.percent
                self._workspace.write_progress(told, {"run": run, "state": live.state.value})
            threading.Event().wait(POLL_S)

    def _analyse(self, link: str, workspace: type[TaskWorkspace[Any]], options: Any) -> None:
        """Have the recordings analysed; goes on with what was submitted before the service was started again."""
        identifier = self._find_submitted(link)
        if identifier is None:
            order_type: type[Any] = workspace.order_type
            order = order_type(**self._robot, **self._recordings(), options=options)
            identifier = self._submit(workspace, order)
        self._workspace.record_made(**{link: identifier})
        self._wait(link, identifier)

    def _recordings(self) -> dict[str, Any]:
        made = self._workspace.read_made()
        lists = {"recordings": made.recordings, "held_out": made.held_out}
        return {role: order_kept(self._dependencies.recordings, names) for role, names in lists.items()}

    def _job(self, kind: str, identifier: str) -> Workspace[Any]:
        return Workspace(self._dependencies.kinds[kind].items.folder(identifier))

    def _find_submitted(self, kind: str) -> str | None:
        """The job that this campaign handed in before the service was started again, where that one counts still."""
        identifier = getattr(self._workspace.read_made(), kind)
        try:
            record = None if identifier is None else self._job(kind, identifier).read_record()
        except NotFoundError:
            return None
        requeue = (JobState.CANCELLED, JobState.INTERRUPTED)
        return None if record is None or record.state in requeue else identifier

    def _begin(self, step: str) -> None:
        if self._stop_requested.is_set():
            raise StoppedError
        self._workspace.write_step(step)

    def _cancel_jobs(self) -> None:
        made, dependencies = self._workspace.read_made(), self._dependencies
        jobs = [("excitation", made.excitation), ("excitation", made.held_out_excitation)]
        jobs += [("identification", made.identification), ("diagnosis", made.diagnosis)]
        for kind, identifier in jobs:
            # one that a full disk does not let be cancelled is done for nobody
            with suppress(NotFoundError, OSError):
                if identifier is not None:
                    dependencies.jobs.cancel(dependencies.kinds[kind], identifier)

    def _move(self, state: JobState, problem: JobProblem | None = None) -> bool:
        record = self._workspace.read_record()
        if record is None or not record.may_become(state):
            return True
        self.state = state
        try:
            self._workspace.write_record(record.moved(state, datetime.now(UTC), problem))
        except OSError:
            _log.exception("the state of campaign %s could not be written", self._workspace.folder.name)
            return False
        return True


def _run_problem(identifier: str, record: RunRecord | None) -> JobProblem:
    if record is None:
        return JobProblem(code="damaged", detail=f"run {identifier}: its files are missing or damaged; begin anew")
    if record.problem is not None:
        return JobProblem(code=record.problem.code, detail=f"run {identifier}: {record.problem.detail}")
    asked = "" if record.stop is None else f" ({record.stop})"
    return JobProblem(code="acquisition", detail=f"run {identifier}: was {record.state}{asked}; begin anew")


class CampaignManager(Manager[CampaignRunner]):
    noun = "campaign"

    def __init__(self, items: ItemStore, dependencies: CampaignDependencies) -> None:
        """Continue the analysis of campaigns that recorded all motions; the others become interrupted."""
        super().__init__(items)
        self._dependencies = dependencies
        for identifier in items.identifiers():
            self._resume(CampaignWorkspace(items.folder(identifier)))

    def submit(self, staged: Path, permit: Permit = FREE) -> str:
        """Start a campaign. Raises BusyError or LeaseError if the arm may not move; the folder stays staged."""
        workspace = CampaignWorkspace(staged)
        order = workspace.read_order()
        if order is None:
            raise TauscopeError("the campaign's order.json is missing or damaged; hand the campaign in again")
        workspace.write_record(JobRecord(state=JobState.QUEUED, created=self.items.clock()))
        claim = order.backend.device(order.robot_name), f"campaign {staged_identifier(staged)}"
        claims = self._dependencies.runs.claims
        with self._lock:
            identifier = self._publish(staged, claims, claim, permit)
            workspace = CampaignWorkspace(self.items.folder(identifier))
            runner = CampaignRunner(workspace, order, self._dependencies, lambda: claims.release(*claim), permit)
            self._supervise(identifier, runner)
        return identifier

    def _resume(self, workspace: CampaignWorkspace) -> None:
        record, order = workspace.read_record(), workspace.read_order()
        if record is None or record.state.is_end:
            workspace.tell_lost_end()
        elif order is not None and workspace.read_made().recordings:
            runner = CampaignRunner(workspace, order, self._dependencies, lambda: None)
            self._supervise(workspace.folder.name, runner)
        else:
            workspace.write_record(record.moved(JobState.INTERRUPTED, self.items.clock(), INTERRUPTED))
