"""The queue of jobs: one after the other into an executor, each in a definite state, also after a restart."""

import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from pathlib import Path

from service.errors import LimitExceededError, NotFoundError
from service.jobs.record import JobProblem, JobRecord
from service.jobs.states import JobState
from service.jobs.workspace import Workspace
from service.store import ItemStore

Work = Callable[[Path], JobProblem | None]
"""Does the job of a folder; returns why it failed. It may run in another process."""

_log = logging.getLogger("tauscope.jobs")

INTERRUPTED = JobProblem(
    code="interrupted", detail="the service ended before this job did; hand the identification in again"
)
CANCELLED = JobProblem(code="cancelled", detail="the job was cancelled on request")
WORKER_LOST = JobProblem(
    code="worker-lost",
    detail="the process that worked on this job ended unexpectedly, perhaps for want of memory; send less data",
)
INTERNAL = JobProblem(code="internal", detail="the job met a fault of Tauscope's own; the service's log says more")


class QueueFullError(LimitExceededError):
    """So many jobs are waiting that no further one is accepted."""


class JobQueue:
    """Jobs waiting for an executor, and jobs in it; the only writer of their states.

    Every method may be called from any thread.
    """

    def __init__(self, items: ItemStore, work: Work, executor: Executor, *, slots: int, most_waiting: int) -> None:
        """Make the queue; jobs that an earlier service left unfinished become `interrupted`.

        Parameters
        ----------
        items : ItemStore
            folders of the jobs
        work : callable
            does the job of a folder
        executor : Executor
            where the work is done; shut down by `close`
        slots : int
            jobs that are in the executor at a time
        most_waiting : int
            jobs that may wait
        """
        self._items = items
        self._work = work
        self._executor = executor
        self._slots = slots
        self._most_waiting = most_waiting
        self._lock = threading.RLock()
        self._waiting: deque[str] = deque()
        self._running: dict[str, Future[JobProblem | None]] = {}
        self._is_closed = False
        items.tidy()
        for identifier in items.identifiers():
            self._move(identifier, JobState.INTERRUPTED, INTERRUPTED)

    def submit(self, staged: Path) -> str:
        """Take a job.

        Parameters
        ----------
        staged : Path
            staged folder that holds the job's input

        Returns
        -------
        str
            the job's identifier

        Raises
        ------
        QueueFullError
            if too many jobs are waiting; the folder stays staged
        """
        with self._lock:
            if self._is_closed or len(self._waiting) >= self._most_waiting:
                raise QueueFullError(f"{len(self._waiting)} jobs are waiting already; try again when one has ended")
            Workspace(staged).write_record(JobRecord(state=JobState.QUEUED, created=self._items.clock()))
            identifier = self._items.publish(staged)
            self._waiting.append(identifier)
            self._fill_slots()
            return identifier

    def cancel_or_remove(self, identifier: str) -> bool:
        """Cancel a job that has not ended; remove one that has, or whose record is damaged.

        Cancelled work stops at its next step; what it still does until then is dropped.

        Parameters
        ----------
        identifier : str
            of the job

        Returns
        -------
        bool
            True where the job was removed

        Raises
        ------
        NotFoundError
            if there is no such job
        """
        with self._lock:
            workspace = Workspace(self._items.folder(identifier))
            if not self._move(identifier, JobState.CANCELLED, CANCELLED):
                self._items.remove(identifier)
                return True
            workspace.ask_to_stop()
            if identifier in self._waiting:
                self._waiting.remove(identifier)
            return False

    def close(self) -> None:
        """End the work; whatever has not ended by itself becomes `interrupted`."""
        with self._lock:
            self._is_closed = True
            unfinished = [*self._running, *self._waiting]
            self._waiting.clear()
            for identifier in unfinished:
                self._move(identifier, JobState.INTERRUPTED, INTERRUPTED)
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _fill_slots(self) -> None:
        """Hand waiting jobs to the executor while it has room."""
        while self._waiting and len(self._running) < self._slots and not self._is_closed:
            identifier = self._waiting.popleft()
            self._move(identifier, JobState.RUNNING)
            try:
                future = self._executor.submit(self._work, self._items.folder(identifier))
            except (BrokenExecutor, RuntimeError, OSError):
                _log.exception("job %s could not be handed to a worker", identifier)
                self._move(identifier, JobState.FAILED, WORKER_LOST)
                continue
            self._running[identifier] = future
            future.add_done_callback(lambda done, ended=identifier: self._end(ended, done))

    def _end(self, identifier: str, future: "Future[JobProblem | None]") -> None:
        """Take note that the work of a job has ended, and begin the next."""
        problem = _problem_of(identifier, future)
        with self._lock:
            self._running.pop(identifier, None)
            try:
                self._move(identifier, JobState.SUCCEEDED if problem is None else JobState.FAILED, problem)
            except OSError:
                # The disk is full or gone: the job becomes `interrupted` with the next start.
                _log.exception("the state of job %s could not be written", identifier)
            self._fill_slots()

    def _move(self, identifier: str, state: JobState, problem: JobProblem | None = None) -> bool:
        """Write a job's new state, if it may follow the present one; False where it may not or the job is gone."""
        try:
            workspace = Workspace(self._items.folder(identifier))
        except NotFoundError:
            return False
        record = workspace.read_record()
        if record is None or not record.may_become(state):
            return False
        workspace.write_record(record.moved(state, self._items.clock(), problem))
        return True


def _problem_of(identifier: str, future: "Future[JobProblem | None]") -> JobProblem | None:
    """Why the work of a job has no result; None where it has one."""
    try:
        return future.result()
    except CancelledError:
        return INTERRUPTED
    except BrokenExecutor:
        _log.error("job %s: its worker process ended unexpectedly", identifier)
        return WORKER_LOST
    except Exception:
        _log.exception("job %s failed for an unforeseen reason", identifier)
        return INTERNAL
