"""The job queue: jobs run one after the other in an executor, and again after a restart that left them unfinished."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from dataclasses import dataclass
from pathlib import Path

from tauscope.errors import LimitExceededError, TauscopeError
from tauscope.server.queue.cluster_executor import ClusterUnavailableError
from tauscope.server.queue.job_folder import JobProblem, JobRecord, JobState, Workspace
from tauscope.server.store.data_folder import ItemStore

Work = Callable[[Path], JobProblem | None]
"""Does the job of a folder; returns why it failed. It may run in another process."""
_log = logging.getLogger("tauscope.jobs")
MOST_ATTEMPTS = 3
"""How often the work of a job is begun whose service was killed meanwhile: it may be what brought the service down."""
TOO_OFTEN = JobProblem(
    code="interrupted",
    detail=f"the service ended {MOST_ATTEMPTS} times in the middle of this job; look into its log, and hand less in",
)


@dataclass(frozen=True, eq=False)
class JobKind:
    """`is_heavy`: whether its work takes minutes: of several slots one stays free of such work."""

    items: ItemStore
    work: Work
    is_heavy: bool = False


@dataclass(frozen=True)
class QueuedJob:
    kind: JobKind
    identifier: str

    @property
    def workspace(self) -> Workspace:
        """Its folder, which may be gone: its record then cannot be read."""
        return Workspace(self.kind.items.root / self.identifier)

    def attempts(self) -> int:
        record = self.workspace.read_record()
        return 0 if record is None else record.attempts

    def move(self, state: JobState, problem: JobProblem | None = None) -> bool:
        """Write a state; False where it may not follow, is damaged or gone. Raises OSError if the disk is full."""
        workspace = self.workspace
        record = workspace.read_record()
        if record is not None and record.state is state:
            workspace.tell_lost_end()
            return True
        if record is None or not record.may_become(state):
            return False
        workspace.write_record(record.moved(state, self.kind.items.clock(), problem))
        return True

    def resume(self) -> JobRecord | None:
        """Have the job wait, if an earlier service left it unfinished; None where it has ended, or ends here."""
        workspace = self.workspace
        record = workspace.read_record()
        if record is None or record.state.is_end:
            workspace.tell_lost_end()
            return None
        if record.attempts >= MOST_ATTEMPTS:
            self.move(JobState.INTERRUPTED, TOO_OFTEN)
            return None
        if record.state is not JobState.QUEUED:
            workspace.write_record(record.moved(JobState.QUEUED, self.kind.items.clock()))
        return record

    def requeue(self) -> None:
        """Have the job wait, because its work is ended with the service, or could not begin."""
        record = self.workspace.read_record()
        try:
            if record is not None and record.may_become(JobState.QUEUED):
                self.workspace.write_record(record.requeue(self.kind.items.clock()))
        except OSError:
            _log.exception("the state of job %s could not be written", self.identifier)


INTERRUPTED = JobProblem(code="interrupted", detail="the service ended before this job did; hand it in again")
CANCELLED = JobProblem(code="cancelled", detail="the job was cancelled on request")
WORKER_LOST = JobProblem(
    code="worker-lost",
    detail="the process that worked on this job ended unexpectedly, perhaps for want of memory; send less data",
)
INTERNAL = JobProblem(code="internal", detail="the job met a fault of Tauscope's own; the service's log says more")


class QueueFullError(LimitExceededError):
    """So many jobs are waiting that no further one is accepted."""


_End = tuple[JobState, JobProblem | None]  # how a job ended


class JobQueue:
    """Jobs that wait, and jobs in an executor; the only writer of their states, called from any thread."""

    def __init__(
        self,
        kinds: Sequence[JobKind],
        executor: Executor,
        *,
        slots: int | Callable[[], int],
        most_waiting: int,
        most_each: int | None = None,
        is_there: Callable[[], bool] = lambda: True,
    ) -> None:
        """Make the queue; jobs that an earlier service left unfinished are done again, in their order."""
        self._executor = executor
        self._slots = slots if callable(slots) else lambda: slots
        self.can_work, self._most_waiting, self._most_each = is_there, most_waiting, most_each
        self._callers: dict[QueuedJob, str] = {}
        self._lock = threading.RLock()
        self._waiting: deque[QueuedJob] = deque()
        self._running: dict[QueuedJob, Future[JobProblem | None]] = {}
        self._unwritten: dict[QueuedJob, _End] = {}
        self._is_hindered = False
        self._is_closed = False
        for kind in kinds:
            kind.items.tidy()
        jobs = [QueuedJob(kind, identifier) for kind in kinds for identifier in kind.items.identifiers()]
        unfinished = [(record.created, job) for job in jobs if (record := job.resume()) is not None]
        with self._lock:
            self._waiting.extend(job for _, job in sorted(unfinished, key=lambda pair: pair[0]))
            self._go_on()

    def submit(self, kind: JobKind, staged: Path, caller: str = "") -> str:
        """Take a job. Raises QueueFullError if too many wait, or too many of the caller's; it stays staged."""
        with self._lock:
            if self._is_closed or len(self._waiting) >= self._most_waiting:
                raise QueueFullError(f"{len(self._waiting)} jobs are waiting already; try again when one has ended")
            self._require_quota(caller)
            Workspace(staged).write_record(JobRecord(state=JobState.QUEUED, created=kind.items.clock()))
            job = QueuedJob(kind, kind.items.publish(staged))
            self._waiting.append(job)
            self._callers[job] = caller
            self._go_on()
            return job.identifier

    def _require_quota(self, caller: str) -> None:
        self._callers = {job: who for job, who in self._callers.items() if job in self._running or job in self._waiting}
        open_jobs = sum(who == caller for who in self._callers.values())
        if caller and self._most_each is not None and open_jobs >= self._most_each:
            raise QueueFullError(f"{open_jobs} jobs of {caller} have not ended; try again when one has")

    def cancel_or_remove(self, kind: JobKind, identifier: str) -> bool:
        """Cancel a job, or remove one that has ended: True then. Raises NotFoundError if there is none."""
        with self._lock:
            if self.cancel(kind, identifier):
                return False
            self._pass_over(QueuedJob(kind, identifier))
            kind.items.remove(identifier)
            return True

    def cancel(self, kind: JobKind, identifier: str) -> bool:
        """Cancel a job; False where it had ended or is damaged. Raises NotFoundError if there is none."""
        with self._lock:
            job, workspace = QueuedJob(kind, identifier), Workspace(kind.items.folder(identifier))
            if workspace.has_ended() or not job.move(JobState.CANCELLED, CANCELLED):
                return False
            self._pass_over(job)
            try:
                workspace.ask_to_stop()
            except OSError:
                _log.warning("the work of job %s could not be told that nobody wants it", identifier, exc_info=True)
            return True

    def waiting(self) -> int:
        return len(self._waiting)

    def settle(self) -> None:
        """Write ends, and begin what waits. Raises OSError if a full disk is still in the way."""
        with self._lock:
            try:
                self._write_ends()
            finally:
                self._fill_slots()

    def close(self) -> None:
        """End the work; whatever has not ended by itself waits for the next start."""
        with self._lock:
            self._is_closed = True
            self._waiting.clear()
            for job in self._running:
                job.requeue()
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _pass_over(self, job: QueuedJob) -> None:
        if job in self._waiting:
            self._waiting.remove(job)

    def _go_on(self) -> None:
        """As `settle`, where nobody can be told: what cannot be written now is written by a later call."""
        try:
            self.settle()
            self._is_hindered = False
        except OSError:
            if not self._is_hindered:
                _log.exception("the state of a job could not be written; it is tried again")
            self._is_hindered = True

    def _fill_slots(self) -> None:
        while (job := self._find_next()) is not None and not self._is_closed and self.can_work():
            is_wanted = job.move(JobState.RUNNING)
            self._waiting.remove(job)
            if is_wanted:  # else it is damaged, or somebody removed it by hand
                self._hand_over(job)

    def _find_next(self) -> QueuedJob | None:
        """The job that is begun next: light ones pass heavy ones that fill all slots but one."""
        slots = self._slots()
        if len(self._running) >= slots:
            return None
        has_room = sum(job.kind.is_heavy for job in self._running) < max(1, slots - 1)
        return next((job for job in self._waiting if has_room or not job.kind.is_heavy), None)

    def _hand_over(self, job: QueuedJob) -> None:
        try:
            future = self._executor.submit(job.kind.work, job.workspace.folder)
        except ClusterUnavailableError:  # it went a moment ago
            job.requeue()
            self._waiting.appendleft(job)
            return
        except (BrokenExecutor, RuntimeError, OSError):
            _log.exception("job %s could not be handed to a worker", job.identifier)
            self._unwritten[job] = (JobState.FAILED, WORKER_LOST)
            self._write_ends()
            return
        self._running[job] = future
        future.add_done_callback(lambda done: self._end(job, done))

    def _end(self, job: QueuedJob, future: "Future[JobProblem | None]") -> None:
        end = self._end_of(job, future)
        with self._lock:
            self._running.pop(job, None)
            self._unwritten[job] = end
            self._go_on()

    def _write_ends(self) -> None:
        """Write how jobs ended; what fails is left for the next time, or done again after the next start."""
        for job, end in list(self._unwritten.items()):
            has_moved = job.move(*end)
            del self._unwritten[job]
            if has_moved and end[0] is JobState.QUEUED and not self._is_closed:
                self._waiting.appendleft(job)

    def _end_of(self, job: QueuedJob, future: "Future[JobProblem | None]") -> _End:
        try:
            problem = future.result()
        except CancelledError:
            problem = INTERRUPTED
        except TauscopeError as error:  # a bound of the worker's
            problem = JobProblem(code=error.code, detail=f"the job {error}")
        except BrokenExecutor as error:
            if not self._is_closed or isinstance(error, ClusterUnavailableError):
                return self._end_lost(job, error)
            problem = INTERRUPTED  # its process was ended with the service
        except Exception:
            _log.exception("job %s failed for an unforeseen reason", job.identifier)
            problem = INTERNAL
        return (JobState.SUCCEEDED if problem is None else JobState.FAILED), problem

    def _end_lost(self, job: QueuedJob, error: Exception) -> _End:
        """A job that was lost with its worker waits again, unless that happened too often: it may be the cause."""
        if job.attempts() >= MOST_ATTEMPTS:
            _log.error("job %s: lost with its worker %d times", job.identifier, MOST_ATTEMPTS)
            return JobState.FAILED, WORKER_LOST
        _log.warning("job %s waits again: %s", job.identifier, error)
        return JobState.QUEUED, None
