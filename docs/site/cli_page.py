"""The page of the command line: what `--help` prints for every verb."""

from collections.abc import Iterator
from typing import Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from tauscope.cli.program import app

COLUMNS = 88

HEAD = """# Command line

What `tauscope --help` prints, then the help of every verb. Ctrl-C ends a command with exit status 130.
"""


def cli_page() -> str:
    """The page of the present parser."""
    return "\n".join([HEAD, *list_help(get_command(app), None, "tauscope")])


def list_help(command: Any, parent: typer.Context | None, name: str) -> Iterator[str]:
    """The help of a command as Markdown, and that of every command below it."""
    context = typer.Context(command, parent=parent, info_name=name, terminal_width=COLUMNS, max_content_width=COLUMNS)
    depth = len(context.command_path.split())
    yield f"{'#' * min(depth + 1, 3)} `{context.command_path}`\n"
    yield f"```text\n{command.get_help(context).rstrip()}\n```\n"
    if isinstance(command, TyperGroup):
        for below in command.list_commands(context):
            found = command.get_command(context, below)
            yield from list_help(found, context, below)
