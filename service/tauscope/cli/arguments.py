"""Arguments that several commands share."""

from pathlib import Path
from typing import Annotated, Any

import typer

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

Units = Annotated[
    str | None,
    typer.Option(
        metavar="COLUMN=UNIT,...",
        help="Units of columns that are not in SI, as in q=deg,t=ms,tau=mA: t (s, ms, us, ns, index), q (rad, deg, m,"
        " mm), qd (rad, deg, rpm, m, mm), tau (Nm, N, A, mA, drive).",
        show_default=False,
    ),
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate",
        "--rate-hz",
        metavar="HZ",
        min=0.0,
        help="Samples a second where t counts samples.",
        show_default=False,
    ),
]
TrustUnits = Annotated[
    bool, typer.Option("--trust-units", help="Use recordings that can hardly be in the stated units.")
]

Columns = Annotated[
    str | None,
    typer.Option(
        metavar="PRESET|FILE.yaml",
        help="Layout of another tool: rtde, libfranka, plotjuggler, lerobot, mujoco, isaac, or a file that"
        " `tauscope recording map` writes.",
        show_default=False,
    ),
]
Decimal = Annotated[str | None, typer.Option(metavar=".|,", help="Decimal sign of a CSV; detected by default.")]
Delimiter = Annotated[
    str | None,
    typer.Option(
        metavar="SIGN",
        help="Delimiter of a CSV: comma, semicolon, tab, blank or |; detected by default.",
    ),
]
Topic = Annotated[str | None, typer.Option(metavar="TOPIC", help="Topic of a log that has several with joint states.")]

RecordingFile = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        exists=True,
        help="Recording: CSV, Parquet, NumPy archive, MCAP, rosbag2 folder, or ROS 1 bag.",
        show_default=False,
    ),
]


def reading_fields(
    columns: str | None,
    units: str | None,
    rate: float | None,
    trust_units: bool,
    decimal: str | None,
    delimiter: str | None,
    topic: str | None,
) -> dict[str, Any]:
    """Fields of `ReadingOptions`; an option overrides the file of ``--columns``.

    Parameters
    ----------
    rate : float or None
        samples a second where t counts samples [Hz]

    Raises
    ------
    typer.BadParameter
        for a part that is no unit, or a layout that cannot be read
    """
    from tauscope.errors import RobotFileError
    from tauscope.robot.recording_layout import RecordingLayout
    from tauscope.robot.recording_layout_file import read_layout

    unit_of = parse_unit_option(units)
    try:
        layout = RecordingLayout() if columns is None else read_layout(columns)
    except RobotFileError as error:
        raise typer.BadParameter(str(error), param_hint="'--columns'") from None
    return {
        "columns": layout.columns,
        "units": {**layout.units, **(unit_of or {})} or unit_of,
        "rate_hz": rate if rate is not None else layout.rate_hz,
        "trust_units": trust_units,
        "decimal": decimal or layout.decimal,
        "delimiter": delimiter or layout.delimiter,
        "topic": topic or layout.topic,
    }


def parse_unit_option(text: str | None) -> dict[str, str] | None:
    """Read the value of ``--units``.

    Raises
    ------
    typer.BadParameter
        for a part that is no unit
    """
    from tauscope.recording.units import parse_units

    try:
        return None if text is None else parse_units(text)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="'--units'") from None
