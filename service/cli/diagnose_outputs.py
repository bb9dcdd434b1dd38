"""Files that ``tauscope diagnose`` writes beside its result."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import typer

from service.diagnosis import Diagnosis, DiagnosisDocument
from service.diagnosis.extended_model import compensation_code, improved_robot, model_document, scenario_text
from service.diagnosis.next_experiment import PlannedExperiment
from service.excitation import trajectory_json
from service.excitation.trajectory_csv import trajectory_csv
from service.excitation.trajectory_files import DEFAULT_RATE_HZ
from service.identification.compensation import RecordingSource
from service.jobs.version import tauscope_version
from service.recording import EffortKind, Recording
from service.report.provenance import record_provenance

CODE = (".py", ".h")
TRAJECTORIES = (".json", ".csv")


@dataclass(frozen=True)
class OutputRequest:
    """Which files are to be written.

    model : Path or None
        the extended model, to keep
    code : tuple of Path
        its compensation as C or Python
    scenario, improved_robot : Path or None
        the same for the simulated arm
    next_trajectory : Path or None
        the motion to record next
    report : Path or None
        a page
    """

    model: Path | None = None
    code: tuple[Path, ...] = ()
    scenario: Path | None = None
    improved_robot: Path | None = None
    next_trajectory: Path | None = None
    report: Path | None = None

    @property
    def paths(self) -> tuple[Path, ...]:
        """All of them."""
        given = (self.model, *self.code, self.scenario, self.improved_robot, self.next_trajectory, self.report)
        return tuple(path for path in given if path is not None)

    def check(self) -> None:
        """Refuse suffixes that name no format, before any work is done.

        Raises
        ------
        typer.BadParameter
            naming the file
        """
        for path in self.code:
            if path.suffix.lower() not in CODE:
                raise typer.BadParameter(
                    f"{str(path)!r}: the suffix names no code; use .py or .h", param_hint="--export"
                )
        path = self.next_trajectory
        if path is not None and path.suffix.lower() not in TRAJECTORIES:
            raise typer.BadParameter(
                f"{str(path)!r}: a trajectory file ends in .json or .csv", param_hint="--next-trajectory"
            )


def contents(
    request: OutputRequest,
    diagnosis: Diagnosis,
    document: DiagnosisDocument,
    planned: PlannedExperiment | None,
    robot_file: Path,
    recordings: Sequence[tuple[Path, Recording]],
    progress: Callable[[str], None],
) -> dict[Path, bytes]:
    """What the files hold.

    Parameters
    ----------
    request : OutputRequest
        which files
    diagnosis : Diagnosis
        the result
    document : DiagnosisDocument
        the same as plain data
    planned : PlannedExperiment or None
        the next motion
    robot_file : Path
        of the arm
    recordings : sequence of (Path, Recording)
        what was diagnosed
    progress : callable
        told the name of each step as it begins

    Raises
    ------
    TauscopeError
        where a format cannot hold the model
    """
    made: dict[Path, str] = {}
    if request.model is not None:
        made[request.model] = model_document(diagnosis).model_dump_json(by_alias=True, indent=1) + "\n"
    if request.scenario is not None:
        made[request.scenario] = scenario_text(diagnosis)
    if request.improved_robot is not None:
        made[request.improved_robot] = improved_robot(diagnosis, robot_file, request.improved_robot)
    if request.next_trajectory is not None and planned is not None:
        as_json = request.next_trajectory.suffix.lower() == ".json"
        text = trajectory_json(planned.trajectory) if as_json else trajectory_csv(planned.trajectory, DEFAULT_RATE_HZ)
        made[request.next_trajectory] = text
    if request.code or request.report is not None:
        progress("hash inputs")
        paths = [str(path) for path, _ in recordings]
        created = datetime.now(UTC)
        provenance = record_provenance(
            command=(), robot=diagnosis.robot, recordings=paths, held_out=[], created=created
        )
        sources = [RecordingSource(e.path, e.sha256) for e in provenance.inputs if e.role == "recording"]
        current = any(recording.effort_kind is EffortKind.CURRENT for _, recording in recordings)
        kind = EffortKind.CURRENT if current else EffortKind.TORQUE
        for path in request.code:
            made[path] = compensation_code(
                diagnosis,
                path.suffix.lower(),
                sources=sources,
                created=created,
                version=tauscope_version(),
                effort_kind=kind,
            )
        if request.report is not None:
            from service.report.diagnosis_report import diagnosis_report

            progress("draw report")
            made[request.report] = diagnosis_report(diagnosis, document, provenance)
    return {path: text.encode() for path, text in made.items()}
