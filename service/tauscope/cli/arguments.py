"""Arguments that several commands share."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer import Argument, Option

from tauscope.cli.verbs import OptionsOf
from tauscope.errors import RobotFileError
from tauscope.recording.units import parse_units
from tauscope.remote_files import find_path
from tauscope.robot.recording_layout import RecordingLayout
from tauscope.robot.robot_file import read_layout
from tauscope.tasks.task import ReadingOptions


def name_output(words: str, metavar: str = "OUT", *names: str) -> Any:
    return Option(*names, metavar=metavar, dir_okay=False, help=words)


def name_input(words: str, metavar: str | None = None, kind: Any = Option, *names: str, **more: Any) -> Any:
    stated: dict[str, Any] = {"exists": True, "dir_okay": False, "show_default": False, **more}
    return kind(*names, metavar=metavar, help=words, **stated)


def _find_input(name: str) -> Path:
    path = find_path(name)
    if isinstance(path, Path) and not path.exists():
        raise typer.BadParameter(f"Path {name!r} does not exist.")
    return path


def _find_file(name: str) -> Path:
    path = _find_input(name)
    if isinstance(path, Path) and path.is_dir():
        raise typer.BadParameter(f"File {name!r} is a directory.")
    return path


def name_recordings(words: str) -> Any:
    """An argument that names recordings, or their URLs."""
    return name_input(words, "RECORDING", Argument, parser=_find_input)


RobotFile = Annotated[
    Path, name_input("Robot file (YAML), or a URDF or MJCF by itself.", "ROBOT", Argument, parser=_find_file)
]
RecordingFile = Annotated[
    Path,
    name_input(
        "Recording: CSV, Parquet, NumPy, MATLAB, JSON, MCAP, rosbag2 folder, or ROS 1 bag.",
        "FILE",
        Argument,
        parser=_find_input,
    ),
]
HeldOut = Annotated[
    list[Path] | None,
    name_input(
        "Recordings that the model is judged by, never made from. All files up to the next option, or up to --,"
        " belong to it.",
        "RECORDING...",
        Option,
        "--held-out",
        parser=_find_input,
    ),
]
Cutoff = Annotated[
    str,
    Option(
        "--cutoff",
        "--cutoff-hz",
        metavar="auto|none|HZ",
        help="Band that torque and model share; chosen from the data by default.",
    ),
]
Json = Annotated[Path | None, name_output("Write the result as JSON; - is standard output.")]
Report = Annotated[Path | None, name_output("Write a page to read, figures included.", "OUT.html")]
# How recordings are read: fields of `ReadingOptions`, before `complete_reading`.
ReadingFields = Annotated[dict[str, Any], OptionsOf(ReadingOptions)]
LayoutFields = Annotated[dict[str, Any], OptionsOf(ReadingOptions, without=("trust_units",))]


def complete_reading(values: Mapping[str, Any]) -> dict[str, Any]:
    """Options override the file of ``--columns``. Raises typer.BadParameter for an unknown unit or layout."""
    text, columns = values["units"], values["columns"]
    try:
        units = None if text is None else parse_units(text)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="'--units'") from None
    try:
        layout = RecordingLayout() if columns is None else read_layout(columns)
    except RobotFileError as error:
        raise typer.BadParameter(str(error), param_hint="'--columns'") from None
    stated = {name: getattr(layout, name) for name in ("rate_hz", "decimal", "delimiter", "topic")}
    given = {name: value for name, value in values.items() if value is not None}
    return {**stated, **given, "columns": layout.columns, "units": {**layout.units, **(units or {})} or units}


def parse_cutoff(text: str) -> float | Literal["auto"] | None:
    """Read ``auto``, ``none`` or a positive number [Hz]. Raises typer.BadParameter for anything else."""
    if text.lower() == "auto":
        return "auto"
    if text.lower() == "none":
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise typer.BadParameter(f"{text!r} is neither auto, none nor a positive number of Hz", param_hint="'--cutoff'")
    return value
