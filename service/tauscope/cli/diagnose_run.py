"""``tauscope diagnose``: read, diagnose, write, show."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import typer

from tauscope.cli.diagnose_outputs import OutputRequest, Source, contents
from tauscope.cli.diagnose_summary import show_diagnosis
from tauscope.cli.output_files import STANDARD_OUTPUT, require_distinct, require_free, write_file
from tauscope.cli.terminal import output, plain, shown_progress
from tauscope.diagnosis import (
    Diagnosis,
    DiagnosisDocument,
    against_model,
    against_saved,
    against_simulation,
    diagnose,
    document,
)
from tauscope.diagnosis.extended_model.saved import read_model
from tauscope.diagnosis.next_experiment import PlannedExperiment, planned_experiment
from tauscope.errors import ExcitationError
from tauscope.identification import Options
from tauscope.recording import EffortKind, Recording, read_recording
from tauscope.robot import Robot, read_robot

IDENTIFIED, MODEL, SAVED = "identified", "model", ".json"


@dataclass(frozen=True)
class DiagnoseRequest:
    """What was asked for on the command line."""

    robot: Path
    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...] = ()
    against: tuple[str, ...] = (IDENTIFIED,)
    options: Options = Options()  # noqa: RUF009 - frozen
    json: Path | None = None
    outputs: OutputRequest = OutputRequest()  # noqa: RUF009 - frozen

    @property
    def simulated(self) -> tuple[Path, ...]:
        """Recordings of a simulator."""
        words = () if self.against in ((IDENTIFIED,), (MODEL,)) or self.saved is not None else self.against
        return tuple(Path(word) for word in words)

    @property
    def compared(self) -> tuple[Path, ...]:
        """Files that the recordings are compared with."""
        return self.simulated if self.saved is None else (self.saved,)

    @property
    def command(self) -> tuple[str, ...]:
        """The command line that does the same, outputs left to whoever repeats it."""
        cutoff = "none" if self.options.cutoff_hz is None else str(self.options.cutoff_hz)
        words = ["tauscope", "diagnose", str(self.robot), *map(str, self.recordings)]
        words += ["--held-out", *map(str, self.held_out)] if self.held_out else []
        return (*words, "--against", *self.against, "--cutoff", cutoff)

    @property
    def saved(self) -> Path | None:
        """A model that was saved before."""
        path = Path(self.against[0])
        return path if len(self.against) == 1 and path.suffix.lower() == SAVED else None


def run_diagnose(request: DiagnoseRequest) -> None:
    """Do what the command line asks for.

    Raises
    ------
    typer.BadParameter
        where files are given twice or are missing, or an output would destroy an input
    TauscopeError
        where the data or the robot cannot answer; where limits allow no next experiment, after all else was written
    """
    compared = request.compared
    inputs = (*request.recordings, *request.held_out, *compared)
    for path in compared:
        if not path.exists():
            raise typer.BadParameter(
                f"{str(path)!r} is neither {IDENTIFIED}, {MODEL}, a recording nor a saved model",
                param_hint="'--against'",
            )
    request.outputs.check()
    require_distinct(inputs)
    outputs = (*(() if request.json is None else (request.json,)), *request.outputs.paths)
    require_free(outputs, (request.robot, *inputs))
    with shown_progress() as progress:
        outcome = diagnose_files(request, progress)
        files = contents(
            request.outputs,
            outcome.diagnosis,
            outcome.document,
            outcome.planned,
            Source(
                request.command,
                request.robot,
                request.recordings,
                request.held_out,
                compared,
                any(recording.effort_kind is EffortKind.CURRENT for recording in outcome.recordings),
            ),
            progress,
        )
        if request.json is not None:
            files[request.json] = (outcome.document.model_dump_json(by_alias=True, indent=1) + "\n").encode()
        progress("write files")
        for path, content in files.items():
            write_file(path, content)
    if request.json is None:
        show_diagnosis(output(), outcome.document)
    if STANDARD_OUTPUT not in outputs:
        for path in filter(files.__contains__, outputs):
            output().print(plain(f"wrote {path}"), soft_wrap=True)
    if outcome.refusal is not None:  # what was found is kept
        raise outcome.refusal


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of it."""

    diagnosis: Diagnosis
    document: DiagnosisDocument
    planned: PlannedExperiment | None
    refusal: ExcitationError | None
    recordings: tuple[Recording, ...]


def diagnose_files(request: DiagnoseRequest, progress: Callable[[str], None]) -> Outcome:
    """Read the files and diagnose the arm."""
    progress(f"read {request.robot}")
    robot = read_robot(request.robot)
    saved = None if request.saved is None else read_model(request.saved, robot)
    recordings = tuple(_read(request.recordings, robot, progress))
    held_out = tuple(_read(request.held_out, robot, progress))
    simulated = tuple(_read(request.simulated, robot, progress))
    found = diagnose(robot, recordings, held_out, request.options, progress)
    if simulated:
        progress("compare with the simulation")
        found = against_simulation(found, simulated, request.options)
    elif saved is not None:
        progress("compare with the saved model")
        found = against_saved(found, saved)
    elif request.against == (MODEL,):
        progress("compare with the model")
        found = against_model(found)
    path = request.outputs.next_trajectory
    planned, refusal = None, None
    try:
        planned = planned_experiment(found, progress, asked=path is not None)
    except ExcitationError as error:
        refusal = error
    where = None if path is None or planned is None else str(path)
    return Outcome(found, document(found, planned, where), planned, refusal, recordings)


def _read(paths: Sequence[Path], robot: Robot, progress: Callable[[str], None]) -> Iterator[Recording]:
    """Recordings with the robot's joints."""
    names = [joint.name for joint in robot.joints]
    for path in paths:
        progress(f"read {path}")
        yield read_recording(path, robot.joint_count, names)
