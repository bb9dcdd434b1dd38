"""``tauscope robot`` and ``tauscope recording``: their arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.arguments import LayoutArguments, ReadingArguments, RecordingFile, RobotFile
from tauscope.cli.verbs import add_verb

robot = typer.Typer(help="Look at robot files.", no_args_is_help=True, rich_markup_mode=None)


@robot.callback()
def _robot() -> None:
    """Make `check` a verb of its own, as a second one will be."""


def check_robot(file: RobotFile) -> None:
    """Show what a robot file says, and everything doubtful in it."""
    from tauscope.cli.inputs_summary import show_robot

    show_robot(file)


add_verb(robot, check_robot, name="check")


RobotOption = Annotated[
    Path | None,
    typer.Option(
        exists=True, dir_okay=False, metavar="ROBOT", help="Robot file: its names, limits, masses and layout."
    ),
]

recording = typer.Typer(help="Look at recordings, and convert them.", no_args_is_help=True, rich_markup_mode=None)


def check(
    file: RecordingFile,
    *,
    joints: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Number of joints that it has to have.")
    ] = None,
    robot: RobotOption = None,
    reading: ReadingArguments,
) -> None:
    """Show what a recording holds, and what to look at before trusting it."""
    options = reading.options()
    from tauscope.cli.inputs_summary import show_recording

    show_recording(file, joints, robot, options.reading)


def convert(
    source: RecordingFile,
    target: Annotated[
        Path, typer.Argument(metavar="TARGET", dir_okay=False, help="File to make: .csv, .parquet or .mcap.")
    ],
    *,
    recover: Annotated[bool, typer.Option(help="Keep what comes before the damage of a truncated MCAP file.")] = False,
    overwrite: Annotated[bool, typer.Option(help="Replace TARGET where it exists.")] = False,
    robot: RobotOption = None,
    reading: LayoutArguments,
) -> None:
    """Write a recording in another format, in SI; the source stays as it is."""
    options = reading.options()
    from tauscope.cli.inputs_summary import convert_file

    convert_file(source, target, robot, options.reading, recover=recover, overwrite=overwrite)


def map_file(
    file: RecordingFile,
    robot: RobotOption = None,
    out: Annotated[
        Path | None, typer.Option(metavar="OUT.yaml", dir_okay=False, help="File to write, for --columns.")
    ] = None,
    ask: Annotated[
        bool | None, typer.Option("--ask/--no-ask", help="Ask for each column; by default on a terminal.")
    ] = None,
) -> None:
    """Write the mapping of another tool's columns: a guess, which questions correct."""
    from tauscope.cli.recording_mapping import map_recording

    map_recording(file, robot, out, ask)


add_verb(recording, map_file, name="map")
add_verb(recording, check)
add_verb(recording, convert)
