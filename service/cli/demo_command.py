"""``tauscope demo``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer


def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", file_okay=False, help="Folder for the results.")] = Path(
        "demo-output"
    ),
) -> None:
    """Identify a simulated arm.

    Simulates the seed paper's arm, identifies it from noisy recordings, and compares the estimate with the truth.

    Parameters
    ----------
    out : Path
        folder for the results
    """
    from service.cli.demo import run_demo

    run_demo(out)
