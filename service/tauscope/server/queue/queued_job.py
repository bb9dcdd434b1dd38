"""A job that the queue sees to: its kind, its folder, and the states that are written there."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tauscope.errors import NotFoundError
from tauscope.server.queue.record import JobProblem, JobRecord
from tauscope.server.queue.states import JobState
from tauscope.server.queue.workspace import Workspace
from tauscope.server.store.items import ItemStore

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
    """A kind of job: where its folders lie and what is done with them."""

    items: ItemStore
    work: Work


@dataclass(frozen=True)
class QueuedJob:
    """A job that has not ended."""

    kind: JobKind
    identifier: str

    @property
    def folder(self) -> Path:
        """Of the job; raises NotFoundError where it is gone."""
        return self.kind.items.folder(self.identifier)

    def attempts(self) -> int:
        """How often the work was begun and not given up in good order; 0 where nobody can tell."""
        try:
            record = Workspace(self.folder).read_record()
        except NotFoundError:
            return 0
        return 0 if record is None else record.attempts

    def move(self, state: JobState, problem: JobProblem | None = None) -> bool:
        """Write a new state, if it may follow the present one.

        An earlier attempt may have written it and failed after that, as on a disk that became full in between.

        Returns
        -------
        bool
            whether the job is in that state now; False where it may not be, its record is damaged, or it is gone

        Raises
        ------
        OSError
            if the disk does not take it
        """
        try:
            workspace = Workspace(self.folder)
        except NotFoundError:
            return False
        record = workspace.read_record()
        if record is not None and record.state is state:
            workspace.tell_lost_end()
            return True
        if record is None or not record.may_become(state):
            return False
        workspace.write_record(record.moved(state, self.kind.items.clock(), problem))
        return True

    def take_up(self) -> JobRecord | None:
        """Have the job wait, if an earlier service left it unfinished; None where it has ended, or ends here."""
        workspace = Workspace(self.folder)
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

    def give_up(self) -> None:
        """Have the job wait, because its work is ended with the service, or could not begin."""
        try:
            workspace = Workspace(self.folder)
            record = workspace.read_record()
            if record is not None and record.may_become(JobState.QUEUED):
                workspace.write_record(record.given_up(self.kind.items.clock()))
        except (NotFoundError, OSError):
            _log.exception("the state of job %s could not be written", self.identifier)
