"""``tauscope recording``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.arguments import RecordingFile
from tauscope.cli.verbs import add_verb

recording = typer.Typer(help="Look at recordings, and convert them.", no_args_is_help=True, rich_markup_mode=None)


def check(
    file: RecordingFile,
    joints: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Number of joints that it has to have.")
    ] = None,
) -> None:
    """Show what a recording holds, and what to look at before trusting it."""
    from tauscope.cli.recording_summary import show_recording

    show_recording(file, joints)


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
