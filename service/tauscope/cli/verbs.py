"""Registering functions as commands: what their docstring says first is what ``--help`` shows."""

import inspect
from collections.abc import Callable

import typer
from typer.core import TyperCommand


def add_verb(
    app: typer.Typer, function: Callable[..., None], cls: type[TyperCommand] = TyperCommand, name: str | None = None
) -> None:
    """Make a function a command of the same name; its help ends where its docstring turns to programmers."""
    app.command(name, cls=cls, help=(inspect.getdoc(function) or "").partition("\n\nParameters\n")[0])(function)
