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
from importlib import import_module
from typing import Annotated, Any

import typer
from typer import Option
from typer.core import TyperGroup
from typer.main import get_command, get_group

from tauscope.errors import TauscopeError
from tauscope.extras import require_extra

DEBUG = "TAUSCOPE_DEBUG"  # environment variable that makes every failure show its traceback


class ExitStatus(IntEnum):
    DONE = 0
    CANNOT_ANSWER = 1
    WRONG_USAGE = 2
    INTERRUPTED = 130


VERBS = {
    "identify": ("identify", "Find an arm's parameters from recordings."),
    "diagnose": ("diagnose", "Say what an arm's model leaves out."),
    "rollout": ("rollout", "Say how far the simulated arm strays from the real one."),
    "excite": ("excite", "Design the motion that tells most about an arm."),
    "export": ("export", "Write a model for a controller or a simulator."),
    "robot": ("inputs", "Look at robot files."),
    "recording": ("inputs", "Look at recordings, and convert them."),
    "run": ("run", "Move an arm and record it."),
    "campaign": ("campaign", "Go from a robot to its model: design a motion, run it, identify and diagnose."),
    "release": ("device", "Let go of an arm that holds: its drives give no torque any more."),
    "doctor": ("device", "Look at adapters and drives, and say what keeps an arm from running well."),
    "bus": ("device", "Look at field buses."),
    "serve": ("serve", "Offer everything over HTTP."),
    "key": ("access", "API keys of the service."),
    "audit": ("access", "Who did what through the service."),
    "store": ("store", "Look after what is kept."),
    "backup": ("store", "Write everything that is kept into one file."),
    "restore": ("store", "Make a data folder from a backup."),
    "model": ("model", "Models of each robot over time: which one is active, and what drifts."),
    "job": ("job", "Do what a schedule repeats, from a timer of the system or by hand."),
    "fleet": ("fleet", "The same analysis for many robots, results in one table."),
    "demo": ("demo", "Run a whole campaign on a simulated arm."),
    "prove": ("prove", "Put the diagnosis to the test: conceal effects, seal the truth, diagnose, count."),
}
"""For each verb the module ``tauscope.cli.…_command`` that has it, and one line of help.

A module is loaded when its verb is called or asked for its own help: the program's own help answers at once.
"""


class Verbs(TyperGroup):
    """The verbs of the program, each loaded when it is needed."""

    def list_commands(self, ctx: typer.Context) -> list[str]:
        return [*VERBS]

    def get_command(self, ctx: typer.Context, cmd_name: str) -> Any:
        if cmd_name not in VERBS:
            return None
        from tauscope.cli.verbs import add_verb

        module, words = VERBS[cmd_name]
        found = vars(import_module(f"tauscope.cli.{module}_command"))[cmd_name]
        if isinstance(found, typer.Typer):
            group = get_group(found)
            group.name, group.help = cmd_name, words
            return group
        single = typer.Typer(rich_markup_mode=None, add_completion=False)
        add_verb(single, found)
        return get_command(single)

    def format_commands(self, ctx: typer.Context, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, words) for name, (_, words) in VERBS.items()])


app = typer.Typer(
    name="tauscope",
    cls=Verbs,
    help="Find a robot arm's true dynamics from its own motion, and what its simulation left out.",
    epilog="Exit status: 0 done, 1 the data or the robot cannot answer, 2 wrong usage.",
    rich_markup_mode=None,  # a message stays one line that `grep` finds, however long its path
    pretty_exceptions_enable=False,
    add_completion=False,
    no_args_is_help=True,
)


def main(arguments: Sequence[str] | None = None) -> int:
    if arguments is None:
        _prepare_process()
    words = list(sys.argv[1:] if arguments is None else arguments)
    verb = next((word for word in words if not word.startswith("-")), "")
    try:
        with require_extra(f"tauscope {verb}".rstrip()):
            get_command(app).main(words, prog_name="tauscope")
    except SystemExit as exit_:
        code = ExitStatus.DONE if exit_.code is None else exit_.code
        return code if isinstance(code, int) else ExitStatus.CANNOT_ANSWER
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
    if asked:
        from tauscope.version import tauscope_version

        typer.echo(f"tauscope {tauscope_version()}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, Option("--version", help="Show the version and exit.", callback=_show_version, is_eager=True)
    ] = False,
) -> None: ...


def _prepare_process() -> None:
    """Any text can be printed; standard error is for our own messages, what libraries think aloud only on demand."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if not (sys.warnoptions or os.environ.get(DEBUG)):
        warnings.simplefilter("ignore")
        logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _fail(message: str) -> int:
    if os.environ.get(DEBUG):
        traceback.print_exc()
    from tauscope.errors import one_line

    typer.echo(one_line(message), err=True)
    return ExitStatus.CANNOT_ANSWER
