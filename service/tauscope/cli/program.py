"""The program: its verbs, and how it ends.

0  done
1  the data or the robot cannot answer; the reason is one line on standard error
2  wrong usage
130  interrupted by Ctrl-C
"""

import io
import logging
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from enum import IntEnum
from typing import Annotated

import typer
from typer.main import get_command

from tauscope.cli.access_command import audit, key
from tauscope.cli.campaign_command import campaign
from tauscope.cli.demo_command import demo
from tauscope.cli.device_command import bus, doctor, release
from tauscope.cli.diagnose_command import diagnose
from tauscope.cli.driver_choice import DriverCommand
from tauscope.cli.excite_command import excite
from tauscope.cli.export_command import export
from tauscope.cli.fleet_command import fleet
from tauscope.cli.identify_command import identify
from tauscope.cli.inputs_command import recording, robot
from tauscope.cli.job_command import job
from tauscope.cli.model_command import model
from tauscope.cli.prove_command import prove
from tauscope.cli.rollout_command import rollout
from tauscope.cli.run_command import run
from tauscope.cli.serve_command import serve
from tauscope.cli.store_command import backup, restore, store
from tauscope.cli.verbs import SeveralValuesCommand, add_verb
from tauscope.errors import TauscopeError
from tauscope.extras import require_extra

DEBUG = "TAUSCOPE_DEBUG"
"""Environment variable that makes every failure show its traceback."""


class ExitStatus(IntEnum):
    """How the program ends."""

    DONE = 0
    CANNOT_ANSWER = 1
    WRONG_USAGE = 2
    INTERRUPTED = 130


app = typer.Typer(
    name="tauscope",
    help="Find a robot arm's true dynamics from its own motion, and what its simulation left out.",
    epilog="Exit status: 0 done, 1 the data or the robot cannot answer, 2 wrong usage.",
    rich_markup_mode=None,  # a message stays one line that `grep` finds, however long its path
    pretty_exceptions_enable=False,
    add_completion=False,
    no_args_is_help=True,
)
add_verb(app, identify, SeveralValuesCommand)
add_verb(app, diagnose, SeveralValuesCommand)
add_verb(app, rollout)
add_verb(app, excite)
add_verb(app, export)
app.add_typer(robot, name="robot")
app.add_typer(recording, name="recording")
add_verb(app, run, DriverCommand)
add_verb(app, campaign, DriverCommand)
add_verb(app, release, DriverCommand)
add_verb(app, doctor, DriverCommand)
app.add_typer(bus, name="bus")
add_verb(app, serve, DriverCommand)
app.add_typer(key, name="key")
app.add_typer(audit, name="audit")
app.add_typer(store, name="store")
add_verb(app, backup)
add_verb(app, restore)
app.add_typer(model, name="model")
app.add_typer(job, name="job")
app.add_typer(fleet, name="fleet")
add_verb(app, demo)
add_verb(app, prove)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program."""
    if arguments is None:
        _prepare_process()
    words = list(sys.argv[1:] if arguments is None else arguments)
    verb = next((word for word in words if not word.startswith("-")), "")
    try:
        with require_extra(f"tauscope {verb}".rstrip()):
            get_command(app).main(words, prog_name="tauscope")
    except SystemExit as exit_:
        return _status(exit_)
    except KeyboardInterrupt:
        return ExitStatus.INTERRUPTED
    except TauscopeError as error:
        return _fail(str(error))
    except Exception as error:
        return _fail(
            f"this is a bug in Tauscope, please report it: {type(error).__name__}: {error} ({DEBUG}=1 shows more)"
        )
    return ExitStatus.DONE


def _show_version(asked: bool) -> None:
    """Answer ``--version``."""
    if asked:
        from importlib.metadata import PackageNotFoundError, version

        try:
            typer.echo(f"tauscope {version('tauscope')}")
        except PackageNotFoundError:
            typer.echo("tauscope 0+source")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version and exit.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Options of the program itself."""


def _prepare_process() -> None:
    """Any text can be printed; standard error is for our own messages, what libraries think aloud only on demand."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if not (sys.warnoptions or os.environ.get(DEBUG)):
        warnings.simplefilter("ignore")
        logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _fail(message: str) -> int:
    """Say why, in one line."""
    if os.environ.get(DEBUG):
        traceback.print_exc()
    from tauscope.robot.messages import one_line

    typer.echo(one_line(message), err=True)
    return ExitStatus.CANNOT_ANSWER


def _status(exit_: SystemExit) -> int:
    """The status that an exit carries, as `sys.exit` reads it."""
    if exit_.code is None:
        return ExitStatus.DONE
    return exit_.code if isinstance(exit_.code, int) else ExitStatus.CANNOT_ANSWER
