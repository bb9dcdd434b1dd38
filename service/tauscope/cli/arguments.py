"""Arguments that several commands share."""

from pathlib import Path
from typing import Annotated

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

RecordingFile = Annotated[
    Path,
    typer.Argument(
        metavar="FILE", exists=True, help="Recording: CSV, Parquet, MCAP, or a rosbag2 folder.", show_default=False
    ),
]


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
