"""``tauscope excite``: read, design, write, show."""

from dataclasses import dataclass
from pathlib import Path

import typer

from tauscope.cli.excite_summary import show_design
from tauscope.cli.output_files import STANDARD_OUTPUT, require_free, write_file
from tauscope.cli.terminal import output, plain, shown_percent
from tauscope.excitation import (
    ExcitationDesign,
    ExcitationOptions,
    OptimiserProgress,
    design_excitation,
    excitation_document,
)
from tauscope.report.quantities import significant
from tauscope.robot import Severity, read_robot
from tauscope.robot.messages import one_line
from tauscope.trajectory.csv_format import trajectory_csv


@dataclass(frozen=True, eq=False)
class Request:
    """What was asked for on the command line.

    rate_hz : float
        samples a second of the CSV [Hz]
    """

    robot: Path
    options: ExcitationOptions
    json: Path | None = None
    csv: Path | None = None
    rate_hz: float = 500.0

    @property
    def outputs(self) -> tuple[Path, ...]:
        """All files to write."""
        return tuple(path for path in (self.json, self.csv) if path is not None)


def run_excite(request: Request) -> None:
    """Do what the command line asks for.

    Raises
    ------
    typer.BadParameter
        where an output would destroy an input
    TauscopeError
        where the robot file is not valid, or no motion keeps the limits
    """
    require_free(request.outputs, [request.robot])
    robot = read_robot(request.robot)
    if robot.urdf is not None:
        require_free(request.outputs, [robot.urdf])
    with shown_percent() as told:

        def tell(progress: OptimiserProgress) -> None:
            told(f"{progress.step}, best {significant(progress.best, 4)}", 100.0 * progress.fraction)

        design = design_excitation(robot, request.options, progress=tell)
    _write(request, design)
    if STANDARD_OUTPUT not in request.outputs:
        show_design(output(), design, robot)
        for path in request.outputs:
            output().print(plain(f"wrote {path}"), soft_wrap=True)
    for finding in robot.findings:
        if finding.severity is Severity.WARNING:
            typer.echo(one_line(f"warning: {finding.where}: {finding.text}"), err=True)


def _write(request: Request, design: ExcitationDesign) -> None:
    """Write the files that were asked for."""
    content: dict[Path, bytes] = {}
    if request.json is not None:
        content[request.json] = (excitation_document(design).model_dump_json(by_alias=True, indent=1) + "\n").encode()
    if request.csv is not None:
        content[request.csv] = trajectory_csv(design.trajectory, request.rate_hz).encode()
    for path, data in content.items():
        write_file(path, data)
