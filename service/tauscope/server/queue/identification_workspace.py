"""The folder of an identification: which file in it holds what."""

import json
from pathlib import Path

from tauscope.errors import NotFoundError
from tauscope.server.queue.identification_order import IdentificationOrder, OrderedRecording
from tauscope.server.queue.stored import read_bytes, read_document, read_stored, write_stored
from tauscope.server.queue.workspace import Workspace


class IdentificationWorkspace(Workspace):
    """Files of an identification job.

    ``order.json``, ``robot/``, ``recordings/`` and ``held_out/`` are its input, ``result.json``, ``plots.json``,
    ``report.html`` and ``exports/`` what the work makes of it.
    """

    def __init__(self, folder: Path) -> None:
        """Look at a job's folder; nothing is opened yet."""
        super().__init__(folder)
        self.robot = folder / "robot"
        self.exports = folder / "exports"
        self.refusals = self.exports / "refused.json"
        self.result = folder / "result.json"
        self.plots = folder / "plots.json"
        self.report = folder / "report.html"
        self._order = folder / "order.json"

    def prepare(self) -> None:
        """Make the folders that hold a job's input."""
        for folder in (self.robot, self.uploads(held_out=False), self.uploads(held_out=True)):
            folder.mkdir()

    def uploads(self, *, held_out: bool) -> Path:
        """The folder of recordings that came with the request."""
        return self.folder / ("held_out" if held_out else "recordings")

    def recording_path(self, recording: OrderedRecording, server: Path, *, held_out: bool) -> Path:
        """Where a recording of the order lies."""
        folder = server if recording.origin == "server" else self.uploads(held_out=held_out)
        return folder / recording.name

    def read_order(self) -> IdentificationOrder | None:
        """The job's input, or None where the file is missing or damaged."""
        return read_stored(self._order, IdentificationOrder)

    def write_order(self, order: IdentificationOrder) -> None:
        """Keep the job's input."""
        write_stored(self._order, order)

    def read_result(self) -> bytes | None:
        """The identification document, or None where the file is missing or damaged."""
        return read_document(self.result, "tauscope.identification/1")

    def read_plots(self) -> bytes | None:
        """Data of its figures, or None where the file is missing or damaged."""
        return read_document(self.plots, "tauscope.identification-plots/1")

    def read_report(self) -> bytes | None:
        """The page, or None where the file is missing."""
        return read_bytes(self.report)

    def refused_exports(self) -> dict[str, str]:
        """Formats that cannot hold the model, each with the reason; empty before the exports were written."""
        try:
            refused = json.loads(self.refusals.read_bytes())
        except (OSError, ValueError, RecursionError):
            return {}
        return {str(key): str(reason) for key, reason in refused.items()} if isinstance(refused, dict) else {}

    def read_export(self, file_name: str) -> bytes:
        """An export.

        Raises
        ------
        NotFoundError
            if it was not written
        """
        try:
            return (self.exports / file_name).read_bytes()
        except OSError:
            raise NotFoundError(f"no export {file_name} is kept here; hand the identification in again") from None
