"""``tauscope recording``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.arguments import Rate, RecordingFile, TrustUnits, Units, parse_unit_option
from tauscope.cli.verbs import add_verb

recording = typer.Typer(help="Look at recordings, and convert them.", no_args_is_help=True, rich_markup_mode=None)


def check(
    file: RecordingFile,
    joints: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Number of joints that it has to have.")
    ] = None,
    robot: Annotated[
        Path | None,
        typer.Option(
            exists=True, dir_okay=False, metavar="ROBOT", help="Robot file: its names, limits, masses and units."
        ),
    ] = None,
    units: Units = None,
    rate: Rate = None,
    trust_units: TrustUnits = False,
) -> None:
    """Show what a recording holds, and what to look at before trusting it.

    Parameters
    ----------
    rate : float or None
        samples a second where t counts samples [Hz]
    """
    unit_of = parse_unit_option(units)
    from tauscope.cli.recording_summary import show_recording
    from tauscope.cli.task_run import make_request
    from tauscope.tasks.task import ReadingOptions

    options = make_request(ReadingOptions, units=unit_of, rate_hz=rate, trust_units=trust_units)
    show_recording(file, joints, robot, options.reading)


def convert(
    source: RecordingFile,
    target: Annotated[
        Path, typer.Argument(metavar="TARGET", dir_okay=False, help="File to make: .csv, .parquet or .mcap.")
    ],
    recover: Annotated[bool, typer.Option(help="Keep what comes before the damage of a truncated MCAP file.")] = False,
    overwrite: Annotated[bool, typer.Option(help="Replace TARGET where it exists.")] = False,
) -> None:
    """Write a recording in another format; the source stays as it is."""
    from tauscope.cli.recording_summary import convert_file

    convert_file(source, target, recover=recover, overwrite=overwrite)


add_verb(recording, check)
add_verb(recording, convert)
