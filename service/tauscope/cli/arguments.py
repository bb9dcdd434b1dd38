"""Arguments that several commands share."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

if TYPE_CHECKING:
    from tauscope.tasks.task import ReadingOptions


def name_output(words: str, metavar: str = "OUT", *names: str) -> Any:
    """An option that names a file to write."""
    return typer.Option(*names, metavar=metavar, dir_okay=False, help=words)


def name_recordings(words: str) -> Any:
    """An argument that names recordings."""
    return typer.Argument(metavar="RECORDING", exists=True, help=words, show_default=False)


RobotFile = Annotated[
    Path,
    typer.Argument(
        metavar="ROBOT",
        exists=True,
        dir_okay=False,
        help="Robot file (YAML), or a URDF or MJCF by itself.",
        show_default=False,
    ),
]
RecordingFile = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        exists=True,
        help="Recording: CSV, Parquet, NumPy archive, MCAP, rosbag2 folder, or ROS 1 bag.",
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
Json = Annotated[Path | None, name_output("Write the result as JSON; - is standard output.")]
Report = Annotated[Path | None, name_output("Write a page to read, figures included.", "OUT.html")]


@dataclass(frozen=True, kw_only=True)
class LayoutArguments:
    """How the columns of a recording are read.

    `rate_hz`: samples a second where t counts samples [Hz].
    """

    units: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN=UNIT,...",
            help="Units of columns that are not in SI, as in q=deg,t=ms,tau=mA: t (s, ms, us, ns, index), q (rad, deg,"
            " m, mm), qd (rad, deg, rpm, m, mm), tau (Nm, N, A, mA, drive).",
            show_default=False,
        ),
    ] = None
    rate_hz: Annotated[
        float | None,
        typer.Option(
            "--rate",
            "--rate-hz",
            metavar="HZ",
            min=0.0,
            help="Samples a second where t counts samples.",
            show_default=False,
        ),
    ] = None
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="PRESET|FILE.yaml",
            help="Layout of another tool: rtde, libfranka, plotjuggler, lerobot, mujoco, isaac, or a file that"
            " `tauscope recording map` writes.",
            show_default=False,
        ),
    ] = None
    decimal: Annotated[str | None, typer.Option(metavar=".|,", help="Decimal sign of a CSV; detected by default.")] = (
        None
    )
    delimiter: Annotated[
        str | None,
        typer.Option(
            metavar="SIGN",
            help="Delimiter of a CSV: comma, semicolon, tab, blank or |; detected by default.",
        ),
    ] = None
    topic: Annotated[
        str | None, typer.Option(metavar="TOPIC", help="Topic of a log that has several with joint states.")
    ] = None

    def fields(self) -> dict[str, Any]:
        """Fields of `ReadingOptions`; an option overrides the file of ``--columns``.

        Raises typer.BadParameter for a part that is no unit, or a layout that cannot be read.
        """
        from tauscope.errors import RobotFileError
        from tauscope.robot.recording_layout import RecordingLayout
        from tauscope.robot.robot_file import read_layout

        unit_of = _parse_units(self.units)
        try:
            layout = RecordingLayout() if self.columns is None else read_layout(self.columns)
        except RobotFileError as error:
            raise typer.BadParameter(str(error), param_hint="'--columns'") from None
        return {
            "columns": layout.columns,
            "units": {**layout.units, **(unit_of or {})} or unit_of,
            "rate_hz": self.rate_hz if self.rate_hz is not None else layout.rate_hz,
            "decimal": self.decimal or layout.decimal,
            "delimiter": self.delimiter or layout.delimiter,
            "topic": self.topic or layout.topic,
        }

    def options(self) -> "ReadingOptions":
        """The same as a task takes them. Raises typer.BadParameter naming the option."""
        fields = self.fields()
        from tauscope.cli.task_run import make_request
        from tauscope.tasks.task import ReadingOptions

        return make_request(ReadingOptions, **fields)


@dataclass(frozen=True, kw_only=True)
class ReadingArguments(LayoutArguments):
    """How recordings are read, and whether they are used against all appearances."""

    trust_units: Annotated[
        bool, typer.Option("--trust-units", help="Use recordings that can hardly be in the stated units.")
    ] = False

    def fields(self) -> dict[str, Any]:
        """Fields of `ReadingOptions`."""
        return {**super().fields(), "trust_units": self.trust_units}


def _parse_units(text: str | None) -> Mapping[str, str] | None:
    """Read the value of ``--units``."""
    from tauscope.recording.units import parse_units

    try:
        return None if text is None else parse_units(text)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="'--units'") from None


def parse_cutoff(text: str) -> float | Literal["auto"] | None:
    """Read the value of ``--cutoff``: ``auto``, ``none`` or a positive number [Hz].

    Raises typer.BadParameter for anything else.
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


def parse_numbers(text: str, option: str, count: int | None = None) -> tuple[float, ...]:
    """Numbers separated by commas, as many as `count` says. Raises typer.BadParameter for anything else."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or not all(map(math.isfinite, numbers)) or (count is not None and len(numbers) != count):
        wanted = "numbers" if count is None else f"{count} numbers"
        raise typer.BadParameter(f"{text!r} is not {wanted} separated by commas", param_hint=f"'{option}'")
    return numbers
