"""The folder of a job: its state, its events, and documents that outlive the service."""

import json
import logging
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from pydantic import JsonValue, ValidationError

from tauscope.errors import TauscopeError
from tauscope.files import is_disk_full, write_atomically
from tauscope.server.queue.record import (
    EndedEvent,
    JobEvent,
    JobProblem,
    JobRecord,
    ProgressEvent,
    StateEvent,
    StepEvent,
    without_folders,
)
from tauscope.server.store.event_log import EventLog
from tauscope.strict_model import StrictModel

Stored = TypeVar("Stored", bound=StrictModel)


def read_stored(path: Path, kind: type[Stored]) -> Stored | None:
    """A stored model, or None where the file is missing or damaged."""
    try:
        return kind.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None


def write_stored(path: Path, model: StrictModel) -> None:
    """Keep a model."""
    write_atomically(path, model.model_dump_json(indent=1).encode())


def read_document(path: Path, schema: str) -> bytes | None:
    """A JSON document as it was written, or None where the file is missing, damaged or of another schema."""
    try:
        content = path.read_bytes()
        document = json.loads(content)
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(document, dict) and document.get("schema") == schema else None


def read_bytes(path: Path) -> bytes | None:
    """A file as it was written, or None where it is missing."""
    try:
        return path.read_bytes()
    except OSError:
        return None


_log = logging.getLogger("tauscope.jobs")


class JobFolder:
    """Step, events and the wish to stop."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.events = EventLog(folder / "events.jsonl")
        self._progress = folder / "progress"
        self._cancel = folder / "cancel"

    def read_step(self) -> str | None:
        """The step that the work is in; None before it began."""
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
        """Tell how far the work is."""
        self.tell(ProgressEvent(time=datetime.now(UTC), percent=percent, figures=dict(figures)))

    def tell(self, event: JobEvent) -> None:
        """Append an event; a disk that takes none does not stop the job."""
        try:
            self.events.append(event.model_dump(mode="json"))
        except (OSError, ValueError):
            _log.warning("an event of job %s could not be written", self.folder.name, exc_info=True)

    def has_told_end(self) -> bool:
        """Whether the end was told."""
        last = self.events.last()
        if last is not None and last.get("kind") == "ended":
            return True
        # Work that was cancelled may have told more behind the end.
        return any(event.content.get("kind") == "ended" for event in self.events.follow().read())

    def ask_to_stop(self) -> None:
        """Ask the work to stop at its next step."""
        self._cancel.touch()

    def is_asked_to_stop(self) -> bool:
        """Whether the work was asked to stop, or its folder is gone."""
        return self._cancel.exists() or not self.folder.exists()


class Workspace(JobFolder):
    """A job in the queue: its state beside its step and its events.

    ``state.json`` is written by whoever leads the job only, ``progress`` by the work only, ``events.jsonl`` by both;
    input is written by whoever hands the job in, and never again.
    """

    def __init__(self, folder: Path) -> None:
        """Look at a job's folder; nothing is opened yet."""
        super().__init__(folder)
        self._record = folder / "state.json"

    def read_record(self) -> JobRecord | None:
        """The job's state, or None where the file is missing or damaged."""
        return read_stored(self._record, JobRecord)

    def has_ended(self) -> bool:
        """Whether nothing will happen to the job any more: it has ended, its state is damaged, or it is gone."""
        record = self.read_record()
        return record is None or record.state.is_end

    def write_record(self, record: JobRecord) -> None:
        """Keep the job's state, and tell it."""
        write_stored(self._record, record)
        self._tell_state(record)

    def tell_lost_end(self) -> None:
        """Tell the end of a job that ended when its events could not be written, or before there were events."""
        record = self.read_record()
        if record is None or not record.state.is_end:
            return
        if not self.has_told_end():
            self._tell_state(record)

    def _tell_state(self, record: JobRecord) -> None:
        """The event of a state."""
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
    """Do the work of a job, and say why it has no result.

    Returns JobProblem or None: why there is no result; None where there is one.
    """
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
