"""``tauscope diagnose``: its arguments."""

from pathlib import Path
from typing import Annotated, Any

import typer

from tauscope.cli.arguments import RobotFile
from tauscope.cli.identify_command import Cutoff, HeldOut, parse_cutoff

Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING",
        exists=True,
        help="Recordings of the real arm that are to be explained: CSV, Parquet, MCAP or rosbag2.",
        show_default=False,
    ),
]
Against = Annotated[
    list[str] | None,
    typer.Option(
        metavar="identified|model|MODEL.json|SIM...",
        help="What the recordings are compared with: the best model that the data allow (default), the robot file's"
        " model block, a model that --model wrote, or recordings made in your own simulator.",
    ),
]


def _output(words: str, metavar: str = "OUT") -> Any:
    """An option that names a file to write."""
    return typer.Option(metavar=metavar, dir_okay=False, help=words)


def diagnose(
    robot: RobotFile,
    recordings: Recordings,
    *,
    held_out: HeldOut = None,
    against: Against = None,
    cutoff: Cutoff = "auto",
    json: Annotated[Path | None, _output("Write the result as JSON; - is standard output.")] = None,
    report: Annotated[Path | None, _output("Write a page with verdict, findings and residuals.", "OUT.html")] = None,
    next_trajectory: Annotated[
        Path | None, _output("Write the motion to record next: what best separates, or shows, what is open.")
    ] = None,
    model: Annotated[Path | None, _output("Write the model with all findings, for --against.", "OUT.json")] = None,
    export: Annotated[
        list[Path] | None, _output("Write compensation code of the model with all findings.", "OUT.py|OUT.h")
    ] = None,
    scenario: Annotated[Path | None, _output("Write the findings for the simulated arm.", "OUT.yaml")] = None,
    improved_robot: Annotated[
        Path | None, _output("Write the robot file with identified links and friction.", "OUT.yaml")
    ] = None,
) -> None:
    """Say what an arm's model leaves out.

    Where recordings and model differ, which physics is missing, how sure that is, how large it is, what it had been
    hiding in the other parameters, and how much better recordings that were held out are then predicted.

    Parameters
    ----------
    cutoff : str
        ``auto``, ``none`` or a frequency [Hz], for the identification
    """
    cutoff_hz = parse_cutoff(cutoff)
    from tauscope.cli.diagnose_outputs import OutputRequest
    from tauscope.cli.diagnose_run import DiagnoseRequest, run_diagnose
    from tauscope.identification import Options

    run_diagnose(
        DiagnoseRequest(
            robot=robot,
            recordings=tuple(recordings),
            held_out=tuple(held_out or ()),
            against=tuple(against or ("identified",)),
            options=Options(cutoff_hz=cutoff_hz),
            json=json,
            outputs=OutputRequest(
                model=model,
                code=tuple(export or ()),
                scenario=scenario,
                improved_robot=improved_robot,
                next_trajectory=next_trajectory,
                report=report,
            ),
        )
    )
