"""The queue of jobs: one after the other into an executor; what a restart leaves unfinished is done again."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from dataclasses import dataclass
from pathlib import Path

from service.errors import LimitExceededError, NotFoundError
from service.jobs.record import JobProblem, JobRecord
from service.jobs.states import JobState
from service.jobs.workspace import Workspace
from service.store import ItemStore

Work = Callable[[Path], JobProblem | None]
"""Does the job of a folder; returns why it failed. It may run in another process."""

_log = logging.getLogger("tauscope.jobs")

INTERRUPTED = JobProblem(code="interrupted", detail="the service ended before this job did; hand it in again")
CANCELLED = JobProblem(code="cancelled", detail="the job was cancelled on request")
MOST_ATTEMPTS = 3
"""How often the work of a job is begun whose service was killed meanwhile: it may be what brought the service down."""

TOO_OFTEN = JobProblem(
    code="interrupted",
    detail=f"the service ended {MOST_ATTEMPTS} times in the middle of this job; look into its log, and hand less in",
)
WORKER_LOST = JobProblem(
    code="worker-lost",
    detail="the process that worked on this job ended unexpectedly, perhaps for want of memory; send less data",
)
INTERNAL = JobProblem(code="internal", detail="the job met a fault of Tauscope's own; the service's log says more")


class QueueFullError(LimitExceededError):
    """So many jobs are waiting that no further one is accepted."""


@dataclass(frozen=True, eq=False)
class JobKind:
    """A kind of job: where its folders lie and what is done with them.

    items : ItemStore
        folders of the jobs
    work : callable
        does the job of a folder
    """

    items: ItemStore
    work: Work


@dataclass(frozen=True)
class _Job:
    """A job that has not ended."""

    kind: JobKind
    identifier: str


class JobQueue:
    """Jobs waiting for an executor, and jobs in it; the only writer of their states.

    Every method may be called from any thread.
    """

    def __init__(self, kinds: Sequence[JobKind], executor: Executor, *, slots: int, most_waiting: int) -> None:
        """Make the queue; jobs that an earlier service left unfinished are done again, in their order.

        Parameters
        ----------
        kinds : sequence of JobKind
            every kind of job that will be handed in
        executor : Executor
            where the work is done; shut down by `close`
        slots : int
            jobs that are in the executor at a time
        most_waiting : int
            jobs that may wait
        """
        self._executor = executor
        self._slots = slots
        self._most_waiting = most_waiting
        self._lock = threading.RLock()
        self._waiting: deque[_Job] = deque()
        self._running: dict[_Job, Future[JobProblem | None]] = {}
        self._is_closed = False
        for kind in kinds:
            kind.items.tidy()
        jobs = [_Job(kind, identifier) for kind in kinds for identifier in kind.items.identifiers()]
        unfinished = [(record.created, job) for job in jobs if (record := _take_up(job)) is not None]
        with self._lock:
            self._waiting.extend(job for _, job in sorted(unfinished, key=lambda pair: pair[0]))
            self._fill_slots()

    def submit(self, kind: JobKind, staged: Path) -> str:
        """Take a job.

        Parameters
        ----------
        kind : JobKind
            of the job
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
            Workspace(staged).write_record(JobRecord(state=JobState.QUEUED, created=kind.items.clock()))
            job = _Job(kind, kind.items.publish(staged))
            self._waiting.append(job)
            self._fill_slots()
            return job.identifier

    def cancel_or_remove(self, kind: JobKind, identifier: str) -> bool:
        """Cancel a job that has not ended; remove one that has, or whose record is damaged.

        Cancelled work stops at its next step; what it still does until then is dropped.

        Parameters
        ----------
        kind : JobKind
            of the job
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
            if self.cancel(kind, identifier):
                return False
            kind.items.remove(identifier)
            return True

    def cancel(self, kind: JobKind, identifier: str) -> bool:
        """Cancel a job that has not ended.

        Parameters
        ----------
        kind : JobKind
            of the job
        identifier : str
            of the job

        Returns
        -------
        bool
            False where it had ended, or its record is damaged

        Raises
        ------
        NotFoundError
            if there is no such job
        """
        with self._lock:
            job, workspace = _Job(kind, identifier), Workspace(kind.items.folder(identifier))
            if not _move(job, JobState.CANCELLED, CANCELLED):
                return False
            workspace.ask_to_stop()
            if job in self._waiting:
                self._waiting.remove(job)
            return True

    def waiting(self) -> int:
        """How many jobs wait."""
        return len(self._waiting)

    def close(self) -> None:
        """End the work; whatever has not ended by itself waits for the next start."""
        with self._lock:
            self._is_closed = True
            self._waiting.clear()
            for job in self._running:
                _give_up(job)
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _fill_slots(self) -> None:
        """Hand waiting jobs to the executor while it has room."""
        while self._waiting and len(self._running) < self._slots and not self._is_closed:
            job = self._waiting.popleft()
            _move(job, JobState.RUNNING)
            try:
                future = self._executor.submit(job.kind.work, job.kind.items.folder(job.identifier))
            except (BrokenExecutor, RuntimeError, OSError):
                _log.exception("job %s could not be handed to a worker", job.identifier)
                _move(job, JobState.FAILED, WORKER_LOST)
                continue
            self._running[job] = future
            future.add_done_callback(lambda done, ended=job: self._end(ended, done))

    def _end(self, job: _Job, future: "Future[JobProblem | None]") -> None:
        """Take note that the work of a job has ended, and begin the next."""
        problem = _problem_of(job.identifier, future)
        with self._lock:
            self._running.pop(job, None)
            try:
                _move(job, JobState.SUCCEEDED if problem is None else JobState.FAILED, problem)
            except OSError:
                # The disk is full or gone: the job is done again with the next start.
                _log.exception("the state of job %s could not be written", job.identifier)
            self._fill_slots()


def _move(job: _Job, state: JobState, problem: JobProblem | None = None) -> bool:
    """Write a job's new state, if it may follow the present one; False where it may not or the job is gone."""
    items = job.kind.items
    try:
        workspace = Workspace(items.folder(job.identifier))
    except NotFoundError:
        return False
    record = workspace.read_record()
    if record is None or not record.may_become(state):
        return False
    workspace.write_record(record.moved(state, items.clock(), problem))
    return True


def _take_up(job: _Job) -> JobRecord | None:
    """Have a job wait that an earlier service left unfinished; None for one that has ended, or ends here."""
    items = job.kind.items
    workspace = Workspace(items.folder(job.identifier))
    record = workspace.read_record()
    if record is None or record.state.is_end:
        workspace.tell_lost_end()
        return None
    if record.attempts >= MOST_ATTEMPTS:
        _move(job, JobState.INTERRUPTED, TOO_OFTEN)
        return None
    if record.state is not JobState.QUEUED:
        workspace.write_record(record.moved(JobState.QUEUED, items.clock()))
    return record


def _give_up(job: _Job) -> None:
    """Have a job wait whose work is ended with the service."""
    items = job.kind.items
    try:
        workspace = Workspace(items.folder(job.identifier))
        record = workspace.read_record()
        if record is not None and record.may_become(JobState.QUEUED):
            workspace.write_record(record.given_up(items.clock()))
    except (NotFoundError, OSError):
        _log.exception("the state of job %s could not be written", job.identifier)


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
