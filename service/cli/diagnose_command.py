"""``tauscope diagnose``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer

from service.cli.arguments import RobotFile
from service.cli.identify_command import Cutoff, HeldOut, parse_cutoff

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
        metavar="identified|model|SIM...",
        help="What the recordings are compared with: the best model that the data allow (default), the robot file's"
        " model block, or recordings made in your own simulator.",
    ),
]


def diagnose(
    robot: RobotFile,
    recordings: Recordings,
    *,
    held_out: HeldOut = None,
    against: Against = None,
    cutoff: Cutoff = "auto",
    json: Annotated[
        Path | None, typer.Option(metavar="OUT", dir_okay=False, help="Write the result as JSON; - is standard output.")
    ] = None,
) -> None:
    """Say what an arm's model leaves out.

    Where recordings and model differ, which physics is missing, how sure that is, how large it is, what it had been
    hiding in the other parameters, and how much better recordings that were held out are then predicted.

    Parameters
    ----------
    robot : Path
        robot file
    recordings : list of Path
        what is explained
    held_out : list of Path or None
        what findings are confirmed by
    against : list of str or None
        ``identified``, ``model`` or files
    cutoff : str
        ``auto``, ``none`` or a frequency [Hz], for the identification
    json : Path or None
        where the result goes
    """
    cutoff_hz = parse_cutoff(cutoff)
    from service.cli.diagnose_run import DiagnoseRequest, run_diagnose
    from service.identification import Options

    run_diagnose(
        DiagnoseRequest(
            robot=robot,
            recordings=tuple(recordings),
            held_out=tuple(held_out or ()),
            against=tuple(against or ("identified",)),
            options=Options(cutoff_hz=cutoff_hz),
            json=json,
        )
    )
