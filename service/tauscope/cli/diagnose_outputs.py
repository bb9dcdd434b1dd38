"""Files that ``tauscope diagnose`` writes beside its result."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import typer

from tauscope.diagnosis import Diagnosis, DiagnosisDocument
from tauscope.diagnosis.extended_model.saved import model_document
from tauscope.diagnosis.next_experiment import PlannedExperiment
from tauscope.export.compensation import RecordingSource
from tauscope.export.extended_compensation import compensation_code
from tauscope.export.simulation_files import improved_robot, scenario_text
from tauscope.recording import EffortKind
from tauscope.report.provenance import Provenance, record_provenance
from tauscope.trajectory import trajectory_json
from tauscope.trajectory.csv_format import trajectory_csv
from tauscope.trajectory.files import DEFAULT_RATE_HZ
from tauscope.version import tauscope_version

CODE = (".py", ".h")
TRAJECTORIES = (".json", ".csv")


@dataclass(frozen=True)
class OutputRequest:
    """Which files are to be written."""

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


@dataclass(frozen=True)
class Source:
    """What was diagnosed."""

    command: tuple[str, ...]
    robot_file: Path
    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...]
    compared: tuple[Path, ...]
    current: bool

    def provenance(self, diagnosis: Diagnosis) -> Provenance:
        """Hashes of all files, versions and the time."""
        return record_provenance(
            command=self.command,
            robot=diagnosis.robot,
            recordings=[str(path) for path in self.recordings],
            held_out=[str(path) for path in self.held_out],
            compared=[str(path) for path in self.compared],
            created=datetime.now(UTC),
        )


def contents(
    request: OutputRequest,
    diagnosis: Diagnosis,
    document: DiagnosisDocument,
    planned: PlannedExperiment | None,
    source: Source,
    progress: Callable[[str], None],
) -> dict[Path, bytes]:
    """What the files hold.

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
        made[request.improved_robot] = improved_robot(diagnosis, source.robot_file, request.improved_robot)
    if request.next_trajectory is not None and planned is not None:
        as_json = request.next_trajectory.suffix.lower() == ".json"
        text = trajectory_json(planned.trajectory) if as_json else trajectory_csv(planned.trajectory, DEFAULT_RATE_HZ)
        made[request.next_trajectory] = text
    if request.code or request.report is not None:
        progress("hash inputs")
        provenance = source.provenance(diagnosis)
        sources = [RecordingSource(e.path, e.sha256) for e in provenance.inputs if e.role == "recording"]
        kind = EffortKind.CURRENT if source.current else EffortKind.TORQUE
        for path in request.code:
            made[path] = compensation_code(
                diagnosis,
                path.suffix.lower(),
                sources=sources,
                created=provenance.created,
                version=tauscope_version(),
                effort_kind=kind,
            )
        if request.report is not None:
            from tauscope.report.diagnosis_report import diagnosis_report

            progress("draw report")
            made[request.report] = diagnosis_report(diagnosis, document, provenance, planned)
    return {path: text.encode() for path, text in made.items()}
