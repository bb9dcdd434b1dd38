"""``tauscope key`` and ``tauscope audit``: who may use the service, and who did."""

import os
from datetime import timedelta
from pathlib import Path

import typer

from tauscope.errors import TauscopeError
from tauscope.server.auth.audit_log import AuditLog
from tauscope.server.auth.keys import ApiKey, KeyFile, parse_scope, utc_now
from tauscope.server.http.settings import default_data_folder


def add_key(name: str, scope: str, days: int, data: Path | None) -> None:
    """Make a key, and print it on standard output.

    Raises TauscopeError if the name is in use, or the file cannot be worked with.

    `days`: how long it holds, for good where 0 [days].
    """
    folder = data or default_data_folder()
    folder.mkdir(parents=True, exist_ok=True)
    life = timedelta(days=days) if days else None
    key, text = KeyFile(folder).add(name, parse_scope(scope), utc_now(), life)
    until = "for good" if key.expires is None else f"until {key.expires:%Y-%m-%d}"
    _note(folder, "key add", key)
    typer.echo(f"key {key.id} of {name}: scope {key.scope}, {until}; this is the only time that it is shown", err=True)
    typer.echo(text)


def list_keys(data: Path | None) -> None:
    """Print all keys, one a line. Raises TauscopeError if the file is damaged."""
    now = utc_now()
    for key in KeyFile(data or default_data_folder()).read():
        expires = "never" if key.expires is None else f"{key.expires:%Y-%m-%d}"
        typer.echo(f"{key.id}  {key.scope:<8} {key.state(now):<8} expires {expires:<11} {key.name}")


def revoke_key(name: str, data: Path | None) -> None:
    """Take a key back. Raises TauscopeError if there is no such key."""
    folder = data or default_data_folder()
    key = KeyFile(folder).revoke(name, utc_now())
    _note(folder, "key revoke", key)
    typer.echo(f"key {key.id} of {key.name} is revoked")


def _note(folder: Path, action: str, key: ApiKey) -> None:
    """Leave an entry in the audit log, in the name of whoever is logged in."""
    AuditLog(folder).append(f"user {os.getuid()}", action, subject=key.name, key=key.id, scope=key.scope.value)


def verify_audit(data: Path | None, head: str | None, file: Path | None) -> None:
    """Check the log, and print the hash of its last entry. Raises TauscopeError if anything is wrong with it."""
    log = AuditLog(data or default_data_folder())
    if file is not None:
        log.path = file
    found = log.verify(head)
    if found.fault is not None:
        hint = f"the {found.entries} entries before it are whole; compare the file with a backup"
        raise TauscopeError(f"{log.path}: {found.fault}; {hint}")
    typer.echo(f"{found.entries} entries, none changed, moved or missing; the last one's hash is {found.head}")
