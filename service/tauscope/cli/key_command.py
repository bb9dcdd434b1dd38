"""``tauscope key``: its arguments."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from tauscope.cli.verbs import add_verb

key = typer.Typer(help="API keys of the service.", no_args_is_help=True, rich_markup_mode=None)

DataFolder = Annotated[
    Path | None,
    typer.Option(metavar="DIR", file_okay=False, help="Data folder of the service; the user's own by default."),
]


def add(
    name: Annotated[str, typer.Argument(help="Who gets the key.")],
    scope: Annotated[
        Literal["read", "analyse", "move", "admin"],
        typer.Option(help="What it may do; each scope includes those before it."),
    ] = "read",
    days: Annotated[int, typer.Option(min=0, max=36500, help="How long it holds; 0: for good.")] = 365,
    data: DataFolder = None,
) -> None:
    """Make a key and print it: it is kept nowhere else. From then on the service asks for keys.

    Parameters
    ----------
    days : int
        how long it holds [days]
    """
    from tauscope.cli.keys import add_key

    add_key(name, scope, days, data)


def list_(data: DataFolder = None) -> None:
    """List all keys: who has them, what they may do, whether they still hold."""
    from tauscope.cli.keys import list_keys

    list_keys(data)


def revoke(
    name: Annotated[str, typer.Argument(help="Name or identifier of the key.")], data: DataFolder = None
) -> None:
    """Take a key back; a service that runs refuses it within seconds."""
    from tauscope.cli.keys import revoke_key

    revoke_key(name, data)


add_verb(key, add)
add_verb(key, list_, name="list")
add_verb(key, revoke)
