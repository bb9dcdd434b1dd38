"""The folder of a diagnosis: which file in it holds what."""

from pathlib import Path

from tauscope.server.queue.diagnosis_order import DiagnosisOrder
from tauscope.server.queue.identification_order import OrderedRecording
from tauscope.server.queue.stored import read_bytes, read_document, read_stored, write_stored
from tauscope.server.queue.workspace import Workspace

ROLES = ("recordings", "held_out", "simulated")
"""What recordings are for; each has a folder of what came with the request."""


class DiagnosisWorkspace(Workspace):
    """Files of a diagnosis job.

    ``order.json``, ``robot/`` and a folder for each of `ROLES` are its input; ``result.json``, ``plots.json``,
    ``model.json``, ``report.html`` and, where a motion was planned, ``trajectory.json`` are what the work makes of it.
    """

    def __init__(self, folder: Path) -> None:
        """Look at a job's folder; nothing is opened yet."""
        super().__init__(folder)
        self.robot = folder / "robot"
        self.result = folder / "result.json"
        self.plots = folder / "plots.json"
        self.model = folder / "model.json"
        self.trajectory = folder / "trajectory.json"
        self.report = folder / "report.html"
        self._order = folder / "order.json"

    def prepare(self) -> None:
        """Make the folders that hold a job's input."""
        for folder in (self.robot, *(self.uploads(role) for role in ROLES)):
            folder.mkdir()

    def uploads(self, role: str) -> Path:
        """The folder of recordings that came with the request."""
        return self.folder / role

    def recording_path(self, recording: OrderedRecording, server: Path, role: str) -> Path:
        """Where a recording of the order lies."""
        return (server if recording.origin == "server" else self.uploads(role)) / recording.name

    def read_order(self) -> DiagnosisOrder | None:
        """The job's input, or None where the file is missing or damaged."""
        return read_stored(self._order, DiagnosisOrder)

    def write_order(self, order: DiagnosisOrder) -> None:
        """Keep the job's input."""
        write_stored(self._order, order)

    def read_result(self) -> bytes | None:
        """The diagnosis document, or None where the file is missing or damaged."""
        return read_document(self.result, "tauscope.diagnosis/1")

    def read_plots(self) -> bytes | None:
        """Data of its figures, or None where the file is missing or damaged."""
        return read_document(self.plots, "tauscope.diagnosis-plots/1")

    def read_report(self) -> bytes | None:
        """The page, or None where the file is missing."""
        return read_bytes(self.report)

    def read_model(self) -> bytes | None:
        """The model with all findings, or None where the file is missing or damaged."""
        return read_document(self.model, "tauscope.model/1")

    def read_trajectory(self) -> bytes | None:
        """The motion to record next, or None where none was planned."""
        return read_document(self.trajectory, "tauscope.trajectory/1")
