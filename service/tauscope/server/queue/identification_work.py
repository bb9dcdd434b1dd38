"""The work of an identification job, as a worker process does it: files in, files out."""

import json
from collections.abc import Iterable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from tauscope.errors import ExportError, RecordingError, TauscopeError
from tauscope.export.compensation import RecordingSource
from tauscope.export.formats import EXPORT_FILES, ExportFormat, ExportInput, make_export
from tauscope.files import write_atomically
from tauscope.identification import Identification, document, identify
from tauscope.recording import EffortKind, Recording, read_recording
from tauscope.report.identification_plots import identification_plots
from tauscope.robot import Robot, read_robot
from tauscope.server.queue.identification_order import IdentificationOrder, OrderedRecording
from tauscope.server.queue.identification_workspace import IdentificationWorkspace
from tauscope.server.queue.job_provenance import job_provenance
from tauscope.server.queue.record import JobProblem, without_folders
from tauscope.server.queue.work import begin_step, do_work
from tauscope.server.store.files import hash_file


def run_identification(folder: Path, server_recordings: Path) -> JobProblem | None:
    """Do an identification job.

    Returns
    -------
    JobProblem or None
        why there is no result; None where there is one
    """
    work = _Work(IdentificationWorkspace(folder), server_recordings)
    return do_work(work.workspace, work.run, *work.folders)


class _Work:
    """One job on its way."""

    def __init__(self, workspace: IdentificationWorkspace, server_recordings: Path) -> None:
        self.workspace = workspace
        self.server_recordings = server_recordings
        uploads = (workspace.uploads(held_out=held_out) for held_out in (False, True))
        self.folders = (*uploads, workspace.robot, server_recordings)
        self.begin = partial(begin_step, workspace)

    def run(self) -> None:
        """Read, identify, write."""
        order = self.workspace.read_order()
        if order is None:
            raise TauscopeError("the job's order.json is missing or damaged; hand the identification in again")
        self.begin("read robot and recordings")
        robot = read_robot(self.workspace.robot / order.robot_file)
        recordings = self._read(order.recordings, robot, held_out=False)
        held_out = self._read(order.held_out, robot, held_out=True)
        identification = identify(robot, recordings, held_out, order.options.to_options(), self.begin)
        self.begin("write result and exports")
        plots = identification_plots(identification, recordings, held_out)
        write_atomically(self.workspace.plots, plots.model_dump_json(by_alias=True).encode())
        write_atomically(self.workspace.report, self._report(identification, order, recordings, held_out).encode())
        content = document(identification).model_dump_json(by_alias=True, indent=1).encode()
        write_atomically(self.workspace.result, content)
        self._write_exports(identification, order, recordings)

    def _report(
        self,
        identification: Identification,
        order: IdentificationOrder,
        recordings: list[Recording],
        held_out: list[Recording],
    ) -> str:
        """The page; what draws it is slow to load and is loaded where it is needed."""
        from tauscope.report.identification_report import identification_report

        groups = (("recording", order.recordings, False), ("held out", order.held_out, True))
        inputs = [
            (role, entry, self.workspace.recording_path(entry, self.server_recordings, held_out=apart))
            for role, entries, apart in groups
            for entry in entries
        ]
        provenance = job_provenance(order.command, self.workspace.robot, inputs)
        return identification_report(identification, recordings, held_out, provenance)

    def _read(self, ordered: Iterable[OrderedRecording], robot: Robot, *, held_out: bool) -> list[Recording]:
        """The recordings of the order, each with the bytes that were ordered."""
        names = [joint.name for joint in robot.joints]
        recordings = []
        for entry in ordered:
            path = self.workspace.recording_path(entry, self.server_recordings, held_out=held_out)
            if entry.origin == "server" and _hash_or_none(path) != entry.sha256:
                hint = "hand the identification in again"
                raise RecordingError(f"{entry.name}: was changed or removed after the job was handed in; {hint}")
            recordings.append(replace(read_recording(path, robot.joint_count, names), name=entry.name))
        return recordings

    def _write_exports(
        self, identification: Identification, order: IdentificationOrder, recordings: list[Recording]
    ) -> None:
        """Every format that can hold the model, and the reasons of those that cannot."""
        robot = identification.robot
        kinds = {recording.effort_kind for recording in recordings}
        given = ExportInput(
            identification,
            sources=[RecordingSource(entry.name, entry.sha256) for entry in order.recordings],
            effort_kind=EffortKind.CURRENT if EffortKind.CURRENT in kinds else EffortKind.TORQUE,
            urdf=None if robot.urdf is None else robot.urdf.read_bytes(),
            created=datetime.now(UTC),
        )
        self.workspace.exports.mkdir(exist_ok=True)
        refusals = {}
        for export_format in ExportFormat:
            try:
                content = make_export(export_format, given)
            except ExportError as error:
                refusals[export_format.value] = without_folders(str(error), *self.folders)
                continue
            write_atomically(self.workspace.exports / EXPORT_FILES[export_format].name, content)
        write_atomically(self.workspace.refusals, json.dumps(refusals, indent=1).encode())


def _hash_or_none(path: Path) -> str | None:
    """The sha256 of a regular file that is no link; None for anything else."""
    if path.is_symlink() or not path.is_file():
        return None
    return hash_file(path)
