"""A queue of jobs of one kind, and what became of its jobs."""

from concurrent.futures import Executor
from pathlib import Path

from tauscope.server.queue.job_folder import JobState, Workspace
from tauscope.server.queue.queue import JobKind, JobQueue, Work
from tauscope.server.store.data_folder import ItemStore


def succeed(_: Path) -> None:
    return None


class OneKind:
    """A queue of jobs of one kind."""

    def __init__(self, items: ItemStore, executor: Executor, work: Work, slots: int) -> None:
        self.kind = JobKind(items, work)
        self.queue = JobQueue([self.kind], executor, slots=slots, most_waiting=2)
        self.close = self.queue.close

    def submit(self, staged: Path) -> str:
        return self.queue.submit(self.kind, staged)

    def cancel_or_remove(self, identifier: str) -> bool:
        return self.queue.cancel_or_remove(self.kind, identifier)


def make_queue(items: ItemStore, executor: Executor, work: Work = succeed, slots: int = 1) -> OneKind:
    return OneKind(items, executor, work, slots)


def state_of(items: ItemStore, identifier: str) -> JobState:
    record = Workspace(items.folder(identifier)).read_record()
    assert record is not None
    return record.state


def problem_of(items: ItemStore, identifier: str) -> str:
    record = Workspace(items.folder(identifier)).read_record()
    assert record is not None
    assert record.problem is not None
    return record.problem.code
