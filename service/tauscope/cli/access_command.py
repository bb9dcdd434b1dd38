"""``tauscope key`` and ``tauscope audit``: who may use the service, and who did."""

import os
from datetime import timedelta
from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Argument, Option

from tauscope.cli.verbs import make_group
from tauscope.errors import TauscopeError
from tauscope.server.auth.audit_log import AuditLog
from tauscope.server.auth.keys import ApiKey, KeyFile, Scope
from tauscope.server.http.settings import default_data_folder
from tauscope.server.store.data_folder import utc_now

DataFolder = Annotated[
    Path | None, Option(metavar="DIR", file_okay=False, help="Data folder of the service; the user's own by default.")
]


def add_key(
    name: Annotated[str, Argument(help="Who gets the key.")],
    scope: Annotated[
        Literal["read", "analyse", "move", "admin"], Option(help="What it may do; each scope includes those before it.")
    ] = "read",
    days: Annotated[int, Option(min=0, max=36500, help="How long it holds; 0: for good.")] = 365,
    data: DataFolder = None,
) -> None:
    """Make a key and print it: it is kept nowhere else. From then on the service asks for keys."""
    folder = data or default_data_folder()
    folder.mkdir(parents=True, exist_ok=True)
    life = timedelta(days=days) if days else None
    key, text = KeyFile(folder).add(name, Scope(scope), utc_now(), life)
    until = "for good" if key.expires is None else f"until {key.expires:%Y-%m-%d}"
    _note(folder, "key add", key)
    typer.echo(f"key {key.id} of {name}: scope {key.scope}, {until}; this is the only time that it is shown", err=True)
    typer.echo(text)


def list_keys(data: DataFolder = None) -> None:
    """List all keys: who has them, what they may do, whether they still hold."""
    now = utc_now()
    for key in KeyFile(data or default_data_folder()).read():
        expires = "never" if key.expires is None else f"{key.expires:%Y-%m-%d}"
        typer.echo(f"{key.id}  {key.scope:<8} {key.state(now):<8} expires {expires:<11} {key.name}")


def revoke_key(name: Annotated[str, Argument(help="Name or id of the key.")], data: DataFolder = None) -> None:
    """Take a key back; a service that runs refuses it within seconds."""
    folder = data or default_data_folder()
    key = KeyFile(folder).revoke(name, utc_now())
    _note(folder, "key revoke", key)
    typer.echo(f"key {key.id} of {key.name} is revoked")


def _note(folder: Path, action: str, key: ApiKey) -> None:
    """Leave an entry in the audit log, in the name of whoever is logged in."""
    AuditLog(folder).append(f"user {os.getuid()}", action, subject=key.name, key=key.id, scope=key.scope.value)


def verify_audit(
    data: DataFolder = None,
    head: Annotated[
        str | None, Option(metavar="HASH", help="Noted hash of an entry that has to be in the log.")
    ] = None,
    file: Annotated[
        Path | None, Option(metavar="FILE", dir_okay=False, help="A copy of the log, to check instead.")
    ] = None,
) -> None:
    """Check that no entry of the audit log was changed, moved or removed, and print the hash of the last one.

    Note that hash now and then where the machine's owner cannot reach it: --head finds out whether the end was cut off.
    """
    log = AuditLog(data or default_data_folder())
    if file is not None:
        log.path = file
    found = log.verify(head)
    if found.fault is not None:
        hint = f"the {found.entries} entries before it are whole; compare the file with a backup"
        raise TauscopeError(f"{log.path}: {found.fault}; {hint}")
    typer.echo(f"{found.entries} entries, none changed, moved or missing; the last one's hash is {found.head}")


key = make_group(add=add_key, list=list_keys, revoke=revoke_key)
audit = make_group(verify=verify_audit)
