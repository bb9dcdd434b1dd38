"""Where the motion of a run comes from: a file that is there, or an excitation that is still designed."""

import shutil
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tauscope.errors import AcquisitionError
from tauscope.server.control.run import RunWorkspace
from tauscope.server.queue.excitation import ExcitationWorkspace
from tauscope.server.queue.job_folder import Workspace
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.queue.record import JobProblem, JobRecord, JobState
from tauscope.server.queue.task_job import TaskWorkspace

Motion = Callable[[RunWorkspace, threading.Event], bool]
"""Sees to it that a run has its trajectory; False where the event, which asks to stop, came first.

Raises TauscopeError where there is none.
"""

POLL_S = 0.05
"""How often the state of a job is looked at by whoever waits for it [s]."""


def ready_motion(run: RunWorkspace, stop: threading.Event) -> bool:
    """The motion of a run whose trajectory is in its folder."""
    return run.trajectory is not None and not stop.is_set()


@dataclass(frozen=True, eq=False)
class DesignedMotion:
    """A motion that a job designs meanwhile."""

    jobs: JobQueue
    excitations: JobKind
    excitation: str

    def __call__(self, run: RunWorkspace, stop: threading.Event) -> bool:
        """Wait for the job and fetch its trajectory. Raises TauscopeError if the job has no result."""
        design = ExcitationWorkspace(self.excitations.items.folder(self.excitation))
        run.write_step("design the motion")
        record = wait_for_end(design, stop)
        if record is None:
            self.jobs.cancel(self.excitations, self.excitation)
            return False
        require_succeeded(record, f"excitation {self.excitation}")
        take_trajectory(design, run)
        return True


def wait_for_end(workspace: Workspace, stop: threading.Event) -> JobRecord | None:
    """Wait until a job has ended.

    Raises AcquisitionError if the job's state is damaged, or the job was removed.

    Returns JobRecord or None: in an end state; None where the event came first.
    """
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

    def __init__(self, problem: JobProblem) -> None:
        super().__init__(problem.detail)
        self.problem = problem


def require_succeeded(record: JobRecord, name: str) -> None:
    """Refuse to go on without a result. Raises StepFailedError with the problem that the job ended in."""
    if record.state is not JobState.SUCCEEDED:
        problem = record.problem or JobProblem(code="internal", detail="it has no result")
        raise StepFailedError(problem.model_copy(update={"detail": f"{name}: {problem.detail}"}))


def take_trajectory(excitation: TaskWorkspace[Any], run: RunWorkspace) -> None:
    """Give a run the trajectory of an excitation that succeeded.

    Raises AcquisitionError if the trajectory is not there any more.
    """
    try:
        shutil.copyfile(excitation.trajectory, run.trajectories / excitation.trajectory.name)
    except FileNotFoundError:
        text = f"excitation {excitation.folder.name}: its trajectory is missing; have it designed again"
        raise AcquisitionError(text) from None
