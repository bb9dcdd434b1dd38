"""The work of a diagnosis job, as a worker process does it: files in, files out."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

from tauscope.diagnosis import Diagnosis, DiagnosisDocument, against_model, against_simulation, diagnose, document
from tauscope.diagnosis.documents.plots import diagnosis_plots
from tauscope.diagnosis.extended_model.saved import model_document
from tauscope.diagnosis.next_experiment import PlannedExperiment, planned_experiment
from tauscope.errors import ExcitationError, RecordingError, TauscopeError
from tauscope.files import write_atomically
from tauscope.recording import Recording, read_recording
from tauscope.robot import Robot, read_robot
from tauscope.server.queue.diagnosis_order import DiagnosisOrder
from tauscope.server.queue.diagnosis_workspace import ROLES, DiagnosisWorkspace
from tauscope.server.queue.identification_order import OrderedRecording
from tauscope.server.queue.job_provenance import job_provenance
from tauscope.server.queue.record import JobProblem
from tauscope.server.queue.work import begin_step, do_work
from tauscope.server.store.files import hash_file
from tauscope.trajectory import trajectory_json


def run_diagnosis(folder: Path, server_recordings: Path) -> JobProblem | None:
    """Do a diagnosis job.

    Returns
    -------
    JobProblem or None
        why there is no result; None where there is one
    """
    workspace = DiagnosisWorkspace(folder)
    work = _Work(workspace, server_recordings)
    return do_work(
        workspace, work.run, *(workspace.uploads(role) for role in ROLES), workspace.robot, server_recordings
    )


class _Work:
    """One job on its way."""

    def __init__(self, workspace: DiagnosisWorkspace, server_recordings: Path) -> None:
        self.workspace = workspace
        self.server_recordings = server_recordings
        self.begin = partial(begin_step, workspace)

    def run(self) -> None:
        """Read, diagnose, write."""
        order = self.workspace.read_order()
        if order is None:
            raise TauscopeError("the job's order.json is missing or damaged; hand the diagnosis in again")
        self.begin("read robot and recordings")
        robot = read_robot(self.workspace.robot / order.robot_file)
        recordings = self._read(order.recordings, robot, "recordings")
        held_out = self._read(order.held_out, robot, "held_out")
        found = diagnose(robot, recordings, held_out, order.options.to_options(), self.begin)
        found = self._compared(found, order, robot)
        planned = self._planned(found, asked=order.options.next_trajectory)
        self.begin("write result")
        name = None if planned is None else self.workspace.trajectory.name
        if planned is not None:
            write_atomically(self.workspace.trajectory, trajectory_json(planned.trajectory).encode())
        write_atomically(self.workspace.plots, diagnosis_plots(found).model_dump_json(by_alias=True).encode())
        write_atomically(self.workspace.model, model_document(found).model_dump_json(by_alias=True, indent=1).encode())
        told = document(found, planned, name)
        write_atomically(self.workspace.report, self._report(found, told, planned, order).encode())
        write_atomically(self.workspace.result, told.model_dump_json(by_alias=True, indent=1).encode())

    def _planned(self, found: Diagnosis, *, asked: bool) -> PlannedExperiment | None:
        """The next experiment; limits that allow none cost nobody what was found."""
        try:
            return planned_experiment(found, self.begin, asked=asked)
        except ExcitationError as error:
            self.begin(f"no next experiment: {error}")
            return None

    def _report(
        self,
        found: Diagnosis,
        told: DiagnosisDocument,
        planned: PlannedExperiment | None,
        order: DiagnosisOrder,
    ) -> str:
        """The page; what draws it is slow to load and is loaded where it is needed."""
        from tauscope.report.diagnosis_report import diagnosis_report

        roles = ("recording", "held out", "compared with")
        groups = (order.recordings, order.held_out, order.simulated)
        inputs = [
            (role, entry, self.workspace.recording_path(entry, self.server_recordings, where))
            for role, where, entries in zip(roles, ROLES, groups, strict=True)
            for entry in entries
        ]
        return diagnosis_report(found, told, job_provenance(order.command, self.workspace.robot, inputs), planned)

    def _compared(self, found: Diagnosis, order: DiagnosisOrder, robot: Robot) -> Diagnosis:
        """The diagnosis compared with what the order names."""
        if order.options.against == "model":
            self.begin("compare with the model")
            return against_model(found)
        if order.options.against == "simulation":
            self.begin("compare with the simulation")
            simulated = self._read(order.simulated, robot, "simulated")
            return against_simulation(found, simulated, order.options.to_options())
        return found

    def _read(self, ordered: Iterable[OrderedRecording], robot: Robot, role: str) -> list[Recording]:
        """The recordings of the order, each with the bytes that were ordered."""
        names = [joint.name for joint in robot.joints]
        recordings = []
        for entry in ordered:
            path = self.workspace.recording_path(entry, self.server_recordings, role)
            if entry.origin == "server" and not _holds(path, entry.sha256):
                hint = "hand the diagnosis in again"
                raise RecordingError(f"{entry.name}: was changed or removed after the job was handed in; {hint}")
            recordings.append(replace(read_recording(path, robot.joint_count, names), name=entry.name))
        return recordings


def _holds(path: Path, sha256: str) -> bool:
    """Whether a regular file that is no link holds these bytes."""
    return not path.is_symlink() and path.is_file() and hash_file(path) == sha256
