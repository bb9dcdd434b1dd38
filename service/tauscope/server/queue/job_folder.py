"""The folder of a job: its record, its events, and documents that outlive the service."""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar

from pydantic import AwareDatetime, Field, JsonValue
from typing_extensions import override

from tauscope.errors import TauscopeError
from tauscope.files import is_disk_full
from tauscope.server.store.event_log import EventLog
from tauscope.server.store.files import parse_object, read_bytes, read_stored, write_stored
from tauscope.strict_model import StrictModel


def without_folders(text: str, *folders: Path) -> str:
    """A message that calls files by their names alone, and says nothing of the server's folders."""
    for folder in folders:
        text = text.replace(f"{folder}/", "")
    return text


@contextmanager
def hide_folders(*folders: Path) -> Iterator[None]:
    """Have errors call files by their names alone, and say nothing of the server's folders."""
    try:
        yield
    except TauscopeError as error:
        raise type(error)(without_folders(str(error), *folders)) from None


class JobState(StrEnum):
    """Where a job stands; four of the six are ends."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    INTERRUPTED = "interrupted"

    @property
    def is_end(self) -> bool:
        return not TRANSITIONS[self]


_ENDS = frozenset([*JobState][-4:])
TRANSITIONS: Mapping[JobState, frozenset[JobState]] = {
    JobState.QUEUED: frozenset({JobState.RUNNING, JobState.CANCELLED, JobState.INTERRUPTED}),
    JobState.RUNNING: _ENDS | {JobState.QUEUED},
    **dict.fromkeys(_ENDS, frozenset()),
}
"""For each state, the states that may follow. A job goes back to `queued` where the service ended before it did, and is
`interrupted` where that happens again and again, or where it moves an arm."""


def may_follow(before: JobState, after: JobState) -> bool:
    return after in TRANSITIONS[before]


class JobProblem(StrictModel):
    code: str = Field(description="code of the error, as in tauscope.errors, or of the way the job ended")
    detail: str = Field(description="one line: what is wrong, where, and what to do")


class JobRecord(StrictModel):
    form: Literal["tauscope.job/1"] = Field(default="tauscope.job/1", description="name and version of this form")
    state: JobState = Field(description="where the job stands")
    created: AwareDatetime = Field(description="when it was handed in")
    started: AwareDatetime | None = Field(default=None, description="when its work began")
    ended: AwareDatetime | None = Field(default=None, description="when it reached its end state")
    problem: JobProblem | None = Field(default=None, description="why it did not succeed")
    attempts: int = Field(default=0, ge=0, description="how often its work was begun and not given up in good order")

    def may_become(self, state: JobState) -> bool:
        return may_follow(self.state, state)

    def moved(self, state: JobState, now: datetime, problem: JobProblem | None = None) -> "JobRecord":
        """The record after a transition. Raises ValueError if that state may not follow: a fault of the caller's."""
        if not self.may_become(state):
            raise ValueError(f"a job that is {self.state} cannot become {state}")
        changes: dict[str, object] = {"ended": now}
        if state is JobState.RUNNING:
            changes = {"started": now, "attempts": self.attempts + 1}
        elif state is JobState.QUEUED:
            changes = {"started": None}
        return self.model_copy(update={"state": state, "problem": problem, **changes})

    def requeue(self, now: datetime) -> "JobRecord":
        """The record of a job that waits again because the service ends in good order: that counts as no attempt."""
        return self.moved(JobState.QUEUED, now).model_copy(update={"attempts": max(0, self.attempts - 1)})


class StateEvent(StrictModel):
    """The job came into another state."""

    kind: Literal["state"] = Field(default="state", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    state: str = Field(description="the state, one that is no end")


class StepEvent(StrictModel):
    """Another step of the work began."""

    kind: Literal["step"] = Field(default="step", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    step: str = Field(description="what is being done, in a few words")


class ProgressEvent(StrictModel):
    """The work came on."""

    kind: Literal["progress"] = Field(default="progress", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    percent: float | None = Field(default=None, description="how much is done, where that is known")
    figures: dict[str, JsonValue] = Field(default={}, description="what is measured meanwhile, by name")


class EndedEvent(StrictModel):
    """The job reached its end; nothing follows."""

    kind: Literal["ended"] = Field(default="ended", description="kind of the event")
    time: AwareDatetime = Field(description="when it happened, UTC")
    state: str = Field(description="the end state")
    problem: JobProblem | None = Field(default=None, description="why it did not succeed")


JobEvent = Annotated[StateEvent | StepEvent | ProgressEvent | EndedEvent, Field(discriminator="kind")]
"""Any of the four."""


def read_document(path: Path, schema: str) -> bytes | None:
    """A JSON document as it was written, or None where the file is missing, damaged or of another schema."""
    content = read_bytes(path)
    return content if (parse_object(content or b"") or {}).get("schema") == schema else None


_log = logging.getLogger("tauscope.jobs")
Order = TypeVar("Order", bound=StrictModel)


class JobFolder(Generic[Order]):
    """What every item keeps in its folder: what was asked for, its robot, steps and events."""

    order_type: ClassVar[type[Any]]
    order_name: ClassVar[str] = "order.json"

    def __init__(self, folder: Path) -> None:
        self.folder, self.robot = folder, folder / "robot"
        self.events = EventLog(folder / "events.jsonl")
        self._progress = folder / "progress"
        self._cancel = folder / "cancel"

    def prepare(self) -> None:
        self.robot.mkdir()

    def read_order(self) -> Order | None:
        return read_stored(self.folder / self.order_name, self.order_type)

    def write_order(self, order: Order) -> None:
        write_stored(self.folder / self.order_name, order)

    def read_record(self) -> Any:
        """What happened to it; None where that is damaged, or it is gone."""
        raise NotImplementedError

    def has_ended(self) -> bool:
        """Whether nothing will happen to it any more: it has ended, its record is damaged, or it is gone."""
        record = self.read_record()
        return record is None or record.state.is_end

    def read_step(self) -> str | None:
        try:
            return self._progress.read_text(encoding="utf-8")
        except (OSError, ValueError):
            return None

    def write_step(self, step: str) -> None:
        """Tell the step that the work is in; worth nothing after a crash, so not brought to the disk."""
        temporary = self._progress.with_suffix(".part")
        temporary.write_text(step, encoding="utf-8")
        temporary.replace(self._progress)
        self.tell(StepEvent(time=datetime.now(UTC), step=step))

    def write_progress(self, percent: float | None, figures: Mapping[str, JsonValue]) -> None:
        self.tell(ProgressEvent(time=datetime.now(UTC), percent=percent, figures=dict(figures)))

    def tell(self, event: JobEvent) -> None:
        """Append an event; a disk that takes none does not stop the job."""
        try:
            self.events.append(event.model_dump(mode="json"))
        except (OSError, ValueError):
            _log.warning("an event of job %s could not be written", self.folder.name, exc_info=True)

    def has_told_end(self) -> bool:
        last = self.events.last()
        if last is not None and last.get("kind") == "ended":
            return True
        # Work that was cancelled may have told more behind the end.
        return any(event.content.get("kind") == "ended" for event in self.events.follow().read())

    def ask_to_stop(self) -> None:
        self._cancel.touch()

    def is_asked_to_stop(self) -> bool:
        """Whether the work was asked to stop, or its folder is gone."""
        return self._cancel.exists() or not self.folder.exists()


class Workspace(JobFolder[Order]):
    """``state.json`` is written by whoever leads the job, ``progress`` by the work, ``events.jsonl`` by both."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self._record = folder / "state.json"

    @override
    def read_record(self) -> JobRecord | None:
        return read_stored(self._record, JobRecord)

    def write_record(self, record: JobRecord) -> None:
        write_stored(self._record, record)
        self._tell_state(record)

    def tell_lost_end(self) -> None:
        """Tell the end of a job that ended when its events could not be written, or before there were events."""
        record = self.read_record()
        if record is not None and record.state.is_end and not self.has_told_end():
            self._tell_state(record)

    def _tell_state(self, record: JobRecord) -> None:
        time = record.ended or record.started or record.created
        if record.state.is_end:
            self.tell(EndedEvent(time=time, state=record.state, problem=record.problem))
        else:
            self.tell(StateEvent(time=time, state=record.state))


STORAGE_FULL = JobProblem(
    code="storage-full", detail="the service's disk was full; remove recordings or items, and hand the job in again"
)


class StoppedError(Exception):
    """The job was cancelled; nobody waits for its result."""


def do_work(workspace: Workspace, work: Callable[[], None], *folders: Path) -> JobProblem | None:
    """Do the work of a job; returns why it has no result, None where it has one."""
    try:
        work()
    except StoppedError:
        return JobProblem(code="cancelled", detail="the job was cancelled")
    except TauscopeError as error:
        return JobProblem(code=error.code, detail=without_folders(str(error), *folders, workspace.folder))
    except OSError as error:
        if not is_disk_full(error):
            raise
        return STORAGE_FULL
    return None


def begin_step(workspace: Workspace, step: str) -> None:
    """Tell a step, unless nobody wants to know any more. Raises StoppedError if the job was cancelled."""
    require_wanted(workspace)
    workspace.write_step(step)


def require_wanted(workspace: Workspace) -> None:
    """Stop a job that was cancelled. Raises StoppedError if it was."""
    if workspace.is_asked_to_stop():
        raise StoppedError
