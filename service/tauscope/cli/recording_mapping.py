"""``tauscope recording map``: from a file's header to a mapping of its columns, by a guess and by questions."""

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import typer

from tauscope.cli.output_files import write_file
from tauscope.cli.terminal import output, plain
from tauscope.recording.columns import map_columns
from tauscope.recording.layout.guess import guess_parts, layout_text
from tauscope.recording.reading import read_header
from tauscope.recording.units import Reading
from tauscope.robot import RecordingLayout, layout_from_dict, read_robot
from tauscope.robot.messages import listed
from tauscope.robot.recording_layout import Source
from tauscope.robot.yaml_text import read_yaml

QUESTIONS = {
    "t": "time",
    "q": "position of every joint",
    "tau": "torque of every joint",
    "i": "current of every joint",
    "qd": "velocity of every joint",
}
NONE = "-"


def map_recording(path: Path, robot_file: Path | None, out: Path | None, asks: bool | None) -> None:
    """Show or write the mapping of a file's columns.

    Raises RecordingError where the file cannot be read, or the mapping does not fit it.
    """
    robot = None if robot_file is None else read_robot(robot_file)
    reading = Reading().for_robot(robot)
    header = read_header(path)
    layout = guess_parts(header, reading.joint_names, prefers_torque=reading.prefers_torque)
    if sys.stdin.isatty() if asks is None else asks:
        typer.echo(f"columns: {listed(header)}", err=True)
        layout = _ask(layout)
    found = map_columns(header, replace(reading, columns=layout.columns or None, units=layout.units), str(path))
    text = layout_text(layout) + "\n"
    if out is not None:
        write_file(out, text.encode())
        output().print(plain(f"wrote {out}: {found.joint_count} joints"), soft_wrap=True)
    else:
        typer.echo(text, nl=False)


def _ask(layout: RecordingLayout) -> RecordingLayout:
    """The layout as the user corrects it."""
    typer.echo(
        f"{{0}} or {{1}} stands for the joint's number from 0 or 1, {{name}} for its name; {NONE}: none", err=True
    )
    guessed: Mapping[str, Source] = layout.columns if isinstance(layout.columns, Mapping) else {}
    columns = dict(guessed)
    for group, words in QUESTIONS.items():
        default = columns.pop(group, NONE)
        shown = (
            default
            if isinstance(default, str)
            else ", ".join(map(str, default if isinstance(default, list) else [default]))
        )
        answer = typer.prompt(f"{group}, {words}", default=shown, err=True).strip()
        if answer != NONE:
            columns[group] = answer if "," not in answer else read_yaml(f"[{answer}]", group).data
    return layout_from_dict({"columns": columns, "units": dict(layout.units)})
