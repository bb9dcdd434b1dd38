"""The folder of an excitation: which file in it holds what."""

from pathlib import Path

from tauscope.server.queue.excitation_order import ExcitationOrder
from tauscope.server.queue.stored import read_document, read_stored, write_stored
from tauscope.server.queue.workspace import Workspace


class ExcitationWorkspace(Workspace):
    """Files of an excitation job: ``order.json`` and ``robot/``; ``result.json`` and ``trajectory.json``."""

    def __init__(self, folder: Path) -> None:
        """Look at a job's folder; nothing is opened yet."""
        super().__init__(folder)
        self.robot = folder / "robot"
        self.result = folder / "result.json"
        self.trajectory = folder / "trajectory.json"
        self._order = folder / "order.json"

    def prepare(self) -> None:
        """Make the folder that holds a job's input."""
        self.robot.mkdir()

    def read_order(self) -> ExcitationOrder | None:
        """The job's input, or None where the file is missing or damaged."""
        return read_stored(self._order, ExcitationOrder)

    def write_order(self, order: ExcitationOrder) -> None:
        """Keep the job's input."""
        write_stored(self._order, order)

    def read_result(self) -> bytes | None:
        """The excitation document, or None where the file is missing or damaged."""
        return read_document(self.result, "tauscope.excitation/1")
