"""``tauscope identify``: its arguments."""

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

from tauscope.cli.arguments import (
    Columns,
    Decimal,
    Delimiter,
    Rate,
    RobotFile,
    Topic,
    TrustUnits,
    Units,
    reading_fields,
)

Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING",
        exists=True,
        help="Recordings that the model is made from: CSV, Parquet, NumPy, MCAP or a bag.",
        show_default=False,
    ),
]
HeldOut = Annotated[
    list[Path] | None,
    typer.Option(
        "--held-out",
        metavar="RECORDING...",
        exists=True,
        help="Recordings that the model is judged by, never made from. All files up to the next option, or up to --,"
        " belong to it.",
    ),
]
Cutoff = Annotated[
    str,
    typer.Option(
        "--cutoff",
        "--cutoff-hz",
        metavar="auto|none|HZ",
        help="Band that torque and model share; chosen from the data by default.",
    ),
]
Export = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE",
        dir_okay=False,
        help="Write the model for a controller or a simulator, by suffix: .json .yaml .h .py (friction compensation),"
        " .urdf, .xml (MJCF). May be repeated.",
    ),
]


def identify(
    robot: RobotFile,
    recordings: Recordings,
    *,
    held_out: HeldOut = None,
    estimator: Annotated[Literal["ls", "wls"], typer.Option(help="How the joints' equations are weighted.")] = "wls",
    cutoff: Cutoff = "auto",
    rotor_inertia: Annotated[
        bool, typer.Option("--rotor-inertia/--no-rotor-inertia", help="Add rotors where the data ask for them.")
    ] = True,
    prior: Annotated[
        bool,
        typer.Option(
            "--prior/--no-prior", help="Deliver the most probable bodies, or the free least-squares estimate."
        ),
    ] = True,
    units: Units = None,
    rate: Rate = None,
    trust_units: TrustUnits = False,
    columns: Columns = None,
    decimal: Decimal = None,
    delimiter: Delimiter = None,
    topic: Topic = None,
    json: Annotated[
        Path | None, typer.Option(metavar="OUT", dir_okay=False, help="Write the result as JSON; - is standard output.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="OUT.html", dir_okay=False, help="Write a page to read, figures included.")
    ] = None,
    export: Export = None,
    model: Annotated[
        Path | None,
        typer.Option(metavar="OUT.json", dir_okay=False, help="Write the model for tauscope export and --against."),
    ] = None,
) -> None:
    """Find an arm's parameters from recordings.

    Base parameters, friction and their uncertainty, the nearest physically consistent links, and how well all of it
    explains recordings that were held out.

    Parameters
    ----------
    cutoff : str
        ``auto``, ``none`` or a frequency [Hz]
    rate : float or None
        samples a second where t counts samples [Hz]
    """
    cutoff_hz = parse_cutoff(cutoff)
    fields = reading_fields(columns, units, rate, trust_units, decimal, delimiter, topic)
    from tauscope.cli.identify_summary import show_identification
    from tauscope.cli.task_run import export_outputs, make_request, run_task
    from tauscope.cli.terminal import output
    from tauscope.export.formats import EXPORT_FILES
    from tauscope.tasks import identify as task

    options = make_request(
        task.IdentificationOptions,
        estimator=estimator,
        cutoff_hz=cutoff_hz,
        rotor_inertia=rotor_inertia,
        prior=prior,
        **fields,
    )
    held = held_out or []
    request = task.Request(
        robot=str(robot),
        recordings=tuple(map(str, recordings)),
        held_out=tuple(map(str, held)),
        options=options,
    )
    outputs = [
        (json, "result.json"),
        (report, "report.html"),
        (model, "model.json"),
        *export_outputs(export or (), EXPORT_FILES),
    ]
    run_task(
        task,
        request,
        outputs,
        (*recordings, *held),
        None if json else lambda result: show_identification(output(), result.document, result.robot),
    )


def parse_cutoff(text: str) -> float | Literal["auto"] | None:
    """Read the value of ``--cutoff``.

    Parameters
    ----------
    text : str
        ``auto``, ``none`` or a positive number [Hz]

    Raises
    ------
    typer.BadParameter
        for anything else
    """
    if text.lower() == "auto":
        return "auto"
    if text.lower() == "none":
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise typer.BadParameter(
            f"{text!r} is neither auto, none nor a positive frequency in Hz", param_hint="'--cutoff'"
        )
    return value
