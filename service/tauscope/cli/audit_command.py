"""``tauscope audit``: its arguments."""

from pathlib import Path
from typing import Annotated

import typer

from tauscope.cli.key_command import DataFolder
from tauscope.cli.verbs import add_verb

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
    from tauscope.cli.audit import verify_audit

    verify_audit(data, head, file)


add_verb(audit, verify)
