"""What every folder of work has, also that of a run: the present step, the events, and the wish to stop."""

import logging
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from pydantic import JsonValue

from tauscope.server.queue.record import JobEvent, ProgressEvent, StepEvent
from tauscope.server.store.event_log import EventLog

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
