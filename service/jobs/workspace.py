"""The folder of one job: which file in it holds what."""

import json
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from service.errors import NotFoundError
from service.jobs.order import IdentificationOrder, OrderedRecording
from service.jobs.record import JobRecord, StoredModel
from service.store import write_atomically

Stored = TypeVar("Stored", bound=StoredModel)


class Workspace:
    """Files of an identification job.

    ``state.json`` is written by the queue only, ``progress`` and the results by the work only; ``order.json``,
    ``robot/``, ``recordings/`` and ``held_out/`` by whoever hands the job in, and never again.
    """

    def __init__(self, folder: Path) -> None:
        """Look at a job's folder; nothing is opened yet.

        Parameters
        ----------
        folder : Path
            of the job
        """
        self.folder = folder
        self.robot = folder / "robot"
        self.exports = folder / "exports"
        self.refusals = self.exports / "refused.json"
        self.result = folder / "result.json"
        self._record = folder / "state.json"
        self._order = folder / "order.json"
        self._progress = folder / "progress"
        self._cancel = folder / "cancel"

    def prepare(self) -> None:
        """Make the folders that hold a job's input."""
        for folder in (self.robot, self.uploads(held_out=False), self.uploads(held_out=True)):
            folder.mkdir()

    def uploads(self, *, held_out: bool) -> Path:
        """The folder of recordings that came with the request.

        Parameters
        ----------
        held_out : bool
            of the held-out ones
        """
        return self.folder / ("held_out" if held_out else "recordings")

    def recording_path(self, recording: OrderedRecording, server: Path, *, held_out: bool) -> Path:
        """Where a recording of the order lies.

        Parameters
        ----------
        recording : OrderedRecording
            of the order
        server : Path
            folder of the recordings that lie on the server
        held_out : bool
            whether it is a held-out one
        """
        folder = server if recording.origin == "server" else self.uploads(held_out=held_out)
        return folder / recording.name

    def read_record(self) -> JobRecord | None:
        """The job's state, or None where the file is missing or damaged."""
        return _read(self._record, JobRecord)

    def write_record(self, record: JobRecord) -> None:
        """Keep the job's state.

        Parameters
        ----------
        record : JobRecord
            the new state
        """
        write_atomically(self._record, record.model_dump_json(indent=1).encode())

    def read_order(self) -> IdentificationOrder | None:
        """The job's input, or None where the file is missing or damaged."""
        return _read(self._order, IdentificationOrder)

    def write_order(self, order: IdentificationOrder) -> None:
        """Keep the job's input.

        Parameters
        ----------
        order : IdentificationOrder
            what is to be identified
        """
        write_atomically(self._order, order.model_dump_json(indent=1).encode())

    def read_step(self) -> str | None:
        """The step that the work is in; None before it began."""
        try:
            return self._progress.read_text(encoding="utf-8")
        except (OSError, ValueError):
            return None

    def write_step(self, step: str) -> None:
        """Tell the step that the work is in; worth nothing after a crash, so not brought to the disk.

        Parameters
        ----------
        step : str
            its name
        """
        temporary = self._progress.with_suffix(".part")
        temporary.write_text(step, encoding="utf-8")
        temporary.replace(self._progress)

    def ask_to_stop(self) -> None:
        """Ask the work to stop at its next step."""
        self._cancel.touch()

    def is_asked_to_stop(self) -> bool:
        """Whether the work was asked to stop, or its folder is gone."""
        return self._cancel.exists() or not self.folder.exists()

    def read_result(self) -> bytes | None:
        """The identification document, or None where the file is missing or damaged."""
        try:
            content = self.result.read_bytes()
            document = json.loads(content)
        except (OSError, ValueError, RecursionError):
            return None
        is_document = isinstance(document, dict) and document.get("schema") == "tauscope.identification/1"
        return content if is_document else None

    def refused_exports(self) -> dict[str, str]:
        """Formats that cannot hold the model, each with the reason; empty before the exports were written."""
        try:
            refused = json.loads(self.refusals.read_bytes())
        except (OSError, ValueError, RecursionError):
            return {}
        return {str(key): str(reason) for key, reason in refused.items()} if isinstance(refused, dict) else {}

    def read_export(self, file_name: str) -> bytes:
        """An export.

        Parameters
        ----------
        file_name : str
            in the folder of exports

        Raises
        ------
        NotFoundError
            if it was not written
        """
        try:
            return (self.exports / file_name).read_bytes()
        except OSError:
            raise NotFoundError(f"no export {file_name} is kept here; hand the identification in again") from None


def _read(path: Path, kind: type[Stored]) -> Stored | None:
    """A stored model, or None where the file is missing or damaged."""
    try:
        return kind.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None
