"""``tauscope audit``: the log checked."""

from pathlib import Path

import typer

from tauscope.errors import TauscopeError
from tauscope.server.auth.audit_log import AuditLog
from tauscope.server.http.settings import default_data_folder


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
