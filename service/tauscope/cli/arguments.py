"""Arguments that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

RobotFile = Annotated[
    Path, typer.Argument(metavar="ROBOT", exists=True, dir_okay=False, help="Robot file (YAML).", show_default=False)
]

RecordingFile = Annotated[
    Path,
    typer.Argument(
        metavar="FILE", exists=True, help="Recording: CSV, Parquet, MCAP, or a rosbag2 folder.", show_default=False
    ),
]
