"""``tauscope identify``: read, identify, write, show."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import typer

from tauscope.cli.exports import export_format, make_exports
from tauscope.cli.identify_summary import show_identification
from tauscope.cli.output_files import STANDARD_OUTPUT, require_distinct, require_free, write_file
from tauscope.cli.terminal import output, plain, shown_progress
from tauscope.identification import Identification, IdentificationDocument, Options, document, identify
from tauscope.recording import Recording, read_recording
from tauscope.report.provenance import Provenance, record_provenance
from tauscope.robot import Robot, Severity, read_robot
from tauscope.robot.messages import one_line


@dataclass(frozen=True)
class Request:
    """What was asked for on the command line."""

    robot: Path
    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...] = ()
    options: Options = Options()  # noqa: RUF009 - frozen
    json: Path | None = None
    report: Path | None = None
    exports: tuple[Path, ...] = ()

    @property
    def outputs(self) -> tuple[Path, ...]:
        """All files to write."""
        return tuple(path for path in (self.json, self.report, *self.exports) if path is not None)

    @property
    def command(self) -> tuple[str, ...]:
        """The command line that does the same, all options spelled out, outputs left to whoever repeats it."""
        options = self.options
        cutoff = "none" if options.cutoff_hz is None else str(options.cutoff_hz)
        words = ["tauscope", "identify", str(self.robot), *map(str, self.recordings)]
        words += ["--held-out", *map(str, self.held_out)] if self.held_out else []
        words += ["--estimator", options.estimator.value, "--cutoff", cutoff]
        return (*words, "--rotor-inertia" if options.rotor_inertia else "--no-rotor-inertia")


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of it."""

    robot: Robot
    recordings: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    identification: Identification
    document: IdentificationDocument


def run_identify(request: Request) -> None:
    """Do what the command line asks for.

    Raises
    ------
    typer.BadParameter
        where files are given twice, or an output would destroy an input
    TauscopeError
        where the data or the robot cannot answer
    """
    check_request(request)
    with shown_progress() as progress:
        outcome = identify_files(request, progress)
        write_outcome(request, outcome, progress)
    if request.json is None:
        show_identification(output(), outcome.document, outcome.robot)
    if STANDARD_OUTPUT not in request.outputs:
        for path in request.outputs:
            output().print(plain(f"wrote {path}"), soft_wrap=True)
    for finding in outcome.robot.findings:
        if finding.severity is Severity.WARNING:
            typer.echo(one_line(f"warning: {finding.where}: {finding.text}"), err=True)


def check_request(request: Request) -> None:
    """Refuse, before any work is done, what is wrong with the files' names.

    A file that is given twice, an output that would destroy an input or cannot be written, a suffix without a format.

    Raises
    ------
    typer.BadParameter
        naming the file
    """
    for path in request.exports:
        export_format(path)
    require_distinct((*request.recordings, *request.held_out))
    require_free(request.outputs, (request.robot, *request.recordings, *request.held_out))


def identify_files(request: Request, progress: Callable[[str], None]) -> Outcome:
    """Read the files and identify the arm."""
    progress(f"read {request.robot}")
    robot = read_robot(request.robot)
    if robot.urdf is not None:
        require_free(request.outputs, [robot.urdf])
    recordings = tuple(_read(request.recordings, robot, progress))
    held_out = tuple(_read(request.held_out, robot, progress))
    identification = identify(robot, recordings, held_out, request.options, progress)
    return Outcome(robot, recordings, held_out, identification, document(identification))


def write_outcome(request: Request, outcome: Outcome, progress: Callable[[str], None]) -> None:
    """Write the files that were asked for: all of them, or none where one cannot be made.

    Raises
    ------
    ExportError
        where a format cannot hold the model, or a file cannot be written
    """
    content: dict[Path, bytes] = {}
    if request.json is not None:
        content[request.json] = (outcome.document.model_dump_json(by_alias=True, indent=1) + "\n").encode()
    if request.report is not None or request.exports:
        progress("hash inputs")
        provenance = _provenance(request, outcome)
        content |= make_exports(request.exports, outcome.identification, outcome.recordings, provenance)
        if request.report is not None:
            progress("draw report")
            content[request.report] = _report(outcome, provenance).encode()
    progress("write files")
    for path, data in content.items():
        write_file(path, data)


def _read(paths: Sequence[Path], robot: Robot, progress: Callable[[str], None]) -> Iterator[Recording]:
    """Recordings with the robot's joints."""
    names = [joint.name for joint in robot.joints]
    for path in paths:
        progress(f"read {path}")
        yield read_recording(path, robot.joint_count, names)


def _provenance(request: Request, outcome: Outcome) -> Provenance:
    """What the result was made from, and when."""
    return record_provenance(
        command=request.command,
        robot=outcome.robot,
        recordings=[str(path) for path in request.recordings],
        held_out=[str(path) for path in request.held_out],
        created=datetime.now(UTC),
    )


def _report(outcome: Outcome, provenance: Provenance) -> str:
    """The page; what draws it is slow to load and is loaded where it is needed."""
    from tauscope.report.identification_report import identification_report

    return identification_report(outcome.identification, outcome.recordings, outcome.held_out, provenance)
