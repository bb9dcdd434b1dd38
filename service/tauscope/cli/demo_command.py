"""``tauscope demo``: its arguments."""

import sys
from pathlib import Path
from typing import Annotated

import typer


def demo(
    out: Annotated[Path, typer.Option(metavar="DIR", file_okay=False, help="Folder for the results.")] = Path(
        "demo-output"
    ),
    page: Annotated[
        bool | None,
        typer.Option(
            "--page/--no-page",
            show_default=False,
            help="Show the page with what was found, until Ctrl-C. By default so in a terminal; elsewhere a process of"
            " its own is left that shows it for a while.",
        ),
    ] = None,
) -> None:
    """Run a whole campaign on a simulated arm.

    Designs a motion for the seed paper's arm and a second one that the model is judged by, runs both, identifies the
    arm from the noisy recordings, and compares the estimate with the truth. Then a campaign through the service on the
    same arm with a concealed spring, which the page shows. Takes a minute or two.
    """
    from tauscope.cli.demo import run_demo
    from tauscope.cli.demo_page import PageShown

    by_default = PageShown.HERE if sys.stdout.isatty() else PageShown.LEFT
    run_demo(out, {None: by_default, True: PageShown.HERE, False: PageShown.NOT}[page])
