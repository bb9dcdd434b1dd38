"""Jobs of the queue that perform a task: their folder, how they are handed in, and how a worker does them."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Literal, TypeVar

from pydantic import Field
from typing_extensions import override

from tauscope.errors import ExportError, NotFoundError, RecordingError, TauscopeError
from tauscope.export.formats import ExportFile, ExportFormat
from tauscope.files import write_atomically
from tauscope.server.queue import job_folder
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.files import hash_file, parse_object, read_bytes
from tauscope.server.store.recordings import RecordingStore
from tauscope.strict_model import StrictModel
from tauscope.tasks.task import ROLES, Files

TRAJECTORY, SAVED_MODEL = "trajectory.json", "against"


class OrderedRecording(StrictModel):
    name: str = Field(description="its file name")
    origin: Literal["uploaded", "server"] = Field(description="sent with the request, or lying on the server")
    sha256: str = Field(description="of its bytes when the job was handed in, in hexadecimal")


class TaskOrder(StrictModel):
    robot_file: str = Field(description="name of the robot file in the job's robot folder")
    robot_name: str = Field(description="what the robot file calls the robot")

    task: ClassVar[ModuleType]

    @property
    def request(self) -> Any:
        fields: dict[str, Any] = {name: getattr(self, name) for name in ("model", "options") if hasattr(self, name)}
        for role in ROLES:
            if role != "model" and hasattr(self, role):
                fields[role] = tuple(entry.name for entry in getattr(self, role))
        return self.task.Request(robot=self.robot_file, **fields)


Order = TypeVar("Order", bound=TaskOrder)


class TaskWorkspace(job_folder.Workspace[Order]):
    """`outputs`: the files that a job leaves, each JSON document with its schema; `formats`: its exports."""

    noun: ClassVar[str]
    roles: ClassVar[tuple[str, ...]] = ()
    takes_model: ClassVar[bool] = False
    outputs: ClassVar[Mapping[str, str | None]]
    formats: ClassVar[Mapping[ExportFormat, ExportFile]] = {}

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.exports = folder / "exports"

    @property
    def trajectory(self) -> Path:
        return self.folder / TRAJECTORY

    @override
    def prepare(self) -> None:
        for folder in (self.robot, *map(self.uploads, (*self.roles, *([SAVED_MODEL] if self.takes_model else [])))):
            folder.mkdir()

    def uploads(self, role: str) -> Path:
        return self.folder / role

    def read_output(self, name: str) -> bytes | None:
        """An output, or None where the file is missing, damaged or of another schema."""
        schema = self.outputs[name]
        path = self.folder / name
        return read_bytes(path) if schema is None else job_folder.read_document(path, schema)

    def read_result(self) -> bytes | None:
        return self.read_output("result.json")

    def refused_exports(self) -> dict[str, str]:
        """Formats that cannot hold the model, each with the reason; empty before the exports were written."""
        refused = parse_object(read_bytes(self.exports / "refused.json") or b"") or {}
        return {key: str(reason) for key, reason in refused.items()}

    def read_export(self, file_name: str) -> bytes:
        """An export. Raises NotFoundError if it was not written."""
        content = read_bytes(self.exports / file_name)
        if content is None:
            raise NotFoundError(f"no export {file_name} is kept here; hand the {self.noun} in again")
        return content

    def write_outputs(self, outputs: Mapping[str, bytes], *folders: Path) -> None:
        """Keep the outputs, every export that can hold the model, and the reasons of those that cannot."""
        refused = {}
        for name in filter(outputs.__contains__, self.outputs):
            write_atomically(self.folder / name, outputs[name])
        for export_format, file in self.formats.items():
            self.exports.mkdir(exist_ok=True)
            try:
                write_atomically(self.exports / file.name, outputs[file.output])
            except ExportError as error:
                refused[export_format.value] = job_folder.without_folders(str(error), *folders)
        if self.formats:
            write_atomically(self.exports / "refused.json", json.dumps(refused, indent=1).encode())


class JobFiles(Files):
    """Files of a request in a job's folder, or among the recordings of the server with the bytes that were ordered."""

    def __init__(self, workspace: TaskWorkspace[Any], order: TaskOrder, server_recordings: Path) -> None:
        self._workspace, self._order, self._server_recordings = workspace, order, server_recordings
        super().__init__()
        self._checked: set[Path] = set()

    @override
    def find(self, role: str, name: str) -> Path:
        """Where an input lies. Raises RecordingError if a recording was changed since the job was handed in."""
        if role in ("robot", "model"):
            return self._workspace.uploads("robot" if role == "robot" else SAVED_MODEL) / name
        entry = next(entry for entry in getattr(self._order, role) if entry.name == name)
        if entry.origin == "uploaded":
            return self._workspace.uploads(role) / name
        path = self._server_recordings / name
        if path not in self._checked and (path.is_symlink() or not path.is_file() or hash_file(path) != entry.sha256):
            hint = f"hand the {self._workspace.noun} in again"
            raise RecordingError(f"{name}: was changed or removed after the job was handed in; {hint}")
        self._checked.add(path)
        return path

    @override
    def show(self, path: Path) -> str:
        """The bare name: reports tell no path of the server."""
        return path.name

    @override
    def target(self, output: str) -> Path | None:
        """The bare name of the trajectory, by which a result refers to it."""
        return Path(output) if output == TRAJECTORY else None


def perform_job(kind: type[TaskWorkspace[Any]], server_recordings: Path, folder: Path) -> job_folder.JobProblem | None:
    """Do a job as a worker does; returns why there is no result, None where there is one."""
    workspace = kind(folder)
    folders = (*map(workspace.uploads, (*workspace.roles, SAVED_MODEL)), workspace.robot, server_recordings)

    def tell(step: str, percent: float | None = None, figures: Mapping[str, Any] = {}) -> None:
        if percent is None:
            job_folder.begin_step(workspace, job_folder.without_folders(step, *folders))
        else:
            job_folder.require_wanted(workspace)
            workspace.write_progress(percent, figures)

    def work() -> None:
        order = workspace.read_order()
        if order is None:
            raise TauscopeError(f"the job's order.json is missing or damaged; hand the {workspace.noun} in again")
        result = order.task.perform(order.request, JobFiles(workspace, order, server_recordings), tell)
        tell("write result and exports")
        workspace.write_outputs(result.outputs, *folders)

    return job_folder.do_work(workspace, work, *folders)


Staged = TypeVar("Staged", bound=job_folder.JobFolder[Any])


@contextmanager
def stage_workspace(items: ItemStore, kind: Callable[[Path], Staged]) -> Iterator[Staged]:
    """A new folder that is removed in the end, unless it was handed in meanwhile."""
    staged = items.stage()
    try:
        workspace = kind(staged)
        workspace.prepare()
        yield workspace
    finally:
        items.discard(staged)


def submit_job(
    jobs: JobQueue, kind: JobKind, workspace: type[TaskWorkspace[Order]], order: Order, put_robot: Callable[[Path], Any]
) -> str:
    """Hand in a job whose files lie on the server; returns its identifier. Raises QueueFullError."""
    with stage_workspace(kind.items, workspace) as staged:
        put_robot(staged.robot)
        staged.write_order(order)
        return jobs.submit(kind, staged.folder)


def order_kept(recordings: RecordingStore, names: Sequence[str]) -> tuple[OrderedRecording, ...]:
    """Recordings that lie on the server, as an order holds them. Raises NotFoundError if one does not lie there."""
    return tuple(OrderedRecording(name=name, origin="server", sha256=recordings.digest(name)) for name in names)
