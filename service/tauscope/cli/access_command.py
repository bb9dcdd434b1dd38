"""``tauscope key`` and ``tauscope audit``: their arguments."""

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
    """Make a key and print it: it is kept nowhere else. From then on the service asks for keys."""
    from tauscope.cli.access_run import add_key

    add_key(name, scope, days, data)


def list_(data: DataFolder = None) -> None:
    """List all keys: who has them, what they may do, whether they still hold."""
    from tauscope.cli.access_run import list_keys

    list_keys(data)


def revoke(
    name: Annotated[str, typer.Argument(help="Name or identifier of the key.")], data: DataFolder = None
) -> None:
    """Take a key back; a service that runs refuses it within seconds."""
    from tauscope.cli.access_run import revoke_key

    revoke_key(name, data)


add_verb(key, add)
add_verb(key, list_, name="list")
add_verb(key, revoke)


audit = typer.Typer(help="Who did what through the service.", no_args_is_help=True, rich_markup_mode=None)


@audit.callback()
def _audit() -> None:
    """Make `verify` a verb of its own, as a second one will be."""


def verify(
    data: DataFolder = None,
    head: Annotated[
        str | None, typer.Option(metavar="HASH", help="Hash of an entry, noted earlier, that has to be in the log.")
    ] = None,
    file: Annotated[
        Path | None, typer.Option(metavar="FILE", dir_okay=False, help="A copy of the log, in place of a data folder.")
    ] = None,
) -> None:
    """Check that no entry of the audit log was changed, moved or removed, and print the hash of the last one.

    Note that hash now and then where the machine's owner cannot reach it: --head finds out whether the end was cut off.
    """
    from tauscope.cli.access_run import verify_audit

    verify_audit(data, head, file)


add_verb(audit, verify)
