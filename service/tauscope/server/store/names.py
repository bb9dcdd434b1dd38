"""Names that may become paths: a single component, of characters that mean nothing to a shell or a file system."""

import re
import secrets
from datetime import UTC, datetime

FILE_NAME_PATTERN = r"^[A-Za-z0-9_][A-Za-z0-9_.+=@ -]{0,127}$"
"""What a file name looks like, for JSON schemas; `is_file_name` is the rule itself."""

FILE_NAME_RULE = "use at most 128 letters a-z, digits and _ . + = @ - or blanks, beginning with a letter, digit or _"

_FILE_NAME = re.compile(FILE_NAME_PATTERN.removeprefix("^").removesuffix("$"))
_IDENTIFIER = re.compile(r"[0-9]{8}T[0-9]{6}Z-[0-9a-f]{8}")


def is_file_name(text: str) -> bool:
    """Whether a text may name a file that is kept: never hidden, never a path, never ending in a blank or a dot."""
    return _FILE_NAME.fullmatch(text) is not None and not text.endswith((" ", "."))


def new_identifier(now: datetime) -> str:
    """A new identifier; sorted as text, identifiers are sorted by the second of their creation."""
    return f"{now.astimezone(UTC):%Y%m%dT%H%M%SZ}-{secrets.token_hex(4)}"


def is_identifier(text: str) -> bool:
    """Whether a text has the form of an identifier."""
    return _IDENTIFIER.fullmatch(text) is not None


def identifier_time(identifier: str) -> datetime:
    """The second in which an identifier was made.

    Raises
    ------
    ValueError
        if it is none
    """
    return datetime.strptime(identifier[:16], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)
