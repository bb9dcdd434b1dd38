"""``tauscope diagnose``: read, diagnose, write, show."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import typer

from service.cli.diagnose_summary import show_diagnosis
from service.cli.output_files import STANDARD_OUTPUT, require_distinct, require_free, write_file
from service.cli.terminal import output, plain, shown_progress
from service.diagnosis import (
    DiagnosisDocument,
    diagnose,
    differences_from_model,
    differences_from_simulation,
    document,
)
from service.identification import Options
from service.recording import Recording, read_recording
from service.robot import Robot, read_robot

IDENTIFIED, MODEL = "identified", "model"


@dataclass(frozen=True)
class DiagnoseRequest:
    """What was asked for on the command line.

    robot : Path
        robot file
    recordings, held_out : tuple of Path
        what is explained, and what findings are confirmed by
    against : tuple of str
        ``identified``, ``model`` or recordings of a simulator
    options : Options
        of the identification
    json : Path or None
        where the result goes
    """

    robot: Path
    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...] = ()
    against: tuple[str, ...] = (IDENTIFIED,)
    options: Options = Options()  # noqa: RUF009 - frozen
    json: Path | None = None

    @property
    def simulated(self) -> tuple[Path, ...]:
        """Recordings of a simulator."""
        return () if self.against in ((IDENTIFIED,), (MODEL,)) else tuple(Path(word) for word in self.against)


def run_diagnose(request: DiagnoseRequest) -> None:
    """Do what the command line asks for.

    Parameters
    ----------
    request : DiagnoseRequest
        files and options

    Raises
    ------
    typer.BadParameter
        where files are given twice or are missing, or an output would destroy an input
    TauscopeError
        where the data or the robot cannot answer
    """
    inputs = (*request.recordings, *request.held_out, *request.simulated)
    for path in request.simulated:
        if not path.exists():
            raise typer.BadParameter(
                f"{str(path)!r} is neither {IDENTIFIED}, {MODEL} nor a recording", param_hint="'--against'"
            )
    require_distinct(inputs)
    outputs = () if request.json is None else (request.json,)
    require_free(outputs, (request.robot, *inputs))
    with shown_progress() as progress:
        result = diagnose_files(request, progress)
        if request.json is not None:
            write_file(request.json, (result.model_dump_json(by_alias=True, indent=1) + "\n").encode())
    if request.json is None:
        show_diagnosis(output(), result)
    elif request.json != STANDARD_OUTPUT:
        output().print(plain(f"wrote {request.json}"), soft_wrap=True)


def diagnose_files(request: DiagnoseRequest, progress: Callable[[str], None]) -> DiagnosisDocument:
    """Read the files and diagnose the arm.

    Parameters
    ----------
    request : DiagnoseRequest
        files and options
    progress : callable
        told the name of each step as it begins

    Returns
    -------
    DiagnosisDocument
        the result
    """
    progress(f"read {request.robot}")
    robot = read_robot(request.robot)
    recordings = tuple(_read(request.recordings, robot, progress))
    held_out = tuple(_read(request.held_out, robot, progress))
    simulated = tuple(_read(request.simulated, robot, progress))
    found = diagnose(robot, recordings, held_out, request.options, progress)
    if simulated:
        progress("compare with the simulation")
        return document(found, "simulation", differences_from_simulation(found, robot, simulated, request.options))
    if request.against == (MODEL,):
        return document(found, MODEL, differences_from_model(found))
    return document(found)


def _read(paths: Sequence[Path], robot: Robot, progress: Callable[[str], None]) -> Iterator[Recording]:
    """Recordings with the robot's joints."""
    names = [joint.name for joint in robot.joints]
    for path in paths:
        progress(f"read {path}")
        yield read_recording(path, robot.joint_count, names)
