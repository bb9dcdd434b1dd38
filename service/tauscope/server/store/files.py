"""Files that arrive: names that may become paths, and bytes that are written and hashed piece by piece."""

import fcntl
import hashlib
import json
import os
import re
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from tauscope.errors import LimitExceededError
from tauscope.files import write_atomically
from tauscope.strict_model import StrictModel

FILE_NAME_PATTERN = r"^[A-Za-z0-9_][A-Za-z0-9_.+=@ -]{0,127}$"
"""What a file name looks like, for JSON schemas; `is_file_name` is the rule itself."""
FILE_NAME_RULE = "use at most 128 letters a-z, digits and _ . + = @ - or blanks, beginning with a letter, digit or _"
_FILE_NAME = re.compile(FILE_NAME_PATTERN.removeprefix("^").removesuffix("$"))
_IDENTIFIER = re.compile(r"[0-9]{8}T[0-9]{6}Z-[0-9a-f]{8}")


def is_file_name(text: str) -> bool:
    """Whether a text may name a file that is kept: never hidden, never a path, never ending in a blank or a dot."""
    return _FILE_NAME.fullmatch(text) is not None and not text.endswith((" ", "."))


def new_identifier(now: datetime) -> str:
    return f"{now.astimezone(UTC):%Y%m%dT%H%M%SZ}-{secrets.token_hex(4)}"


def is_identifier(text: str) -> bool:
    return _IDENTIFIER.fullmatch(text) is not None


def identifier_time(identifier: str) -> datetime:
    """The second in which an identifier was made. Raises ValueError if it is none."""
    return datetime.strptime(identifier[:16], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)


@dataclass(frozen=True)
class KeptFile:
    """`sha256`: of its bytes, in hexadecimal."""

    path: Path
    name: str
    size: int
    sha256: str


class IncomingFile:
    """A file that is being written under a hidden name, until `finish` or `discard`."""

    def __init__(self, folder: Path, name: str, limit: int) -> None:
        """Begin an empty file. `limit`: largest size that is accepted [bytes]."""
        descriptor, path = tempfile.mkstemp(dir=folder, prefix=".incoming-")
        self._file = os.fdopen(descriptor, "wb")
        self._hash = hashlib.sha256()
        self.path = Path(path)
        self.name, self.limit = name, limit
        self.size = 0

    def write(self, piece: bytes) -> None:
        """Raises LimitExceededError if the file grows beyond its limit; nothing more is written then."""
        self.size += len(piece)
        if self.size > self.limit:
            raise LimitExceededError(f"{self.name}: is larger than the {self.limit} bytes accepted here; send less")
        self._hash.update(piece)
        self._file.write(piece)

    def finish(self) -> KeptFile:
        """Bring the bytes to the disk and close the file; it keeps its hidden name."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        return KeptFile(self.path, self.name, self.size, self._hash.hexdigest())

    def discard(self) -> None:
        self._file.close()
        self.path.unlink(missing_ok=True)


@contextmanager
def lock_file(path: Path, flags: int = 0, mode: int = 0o600) -> Iterator[int]:
    """Open a file that is made where it is missing, and hold its lock meanwhile; gives out the descriptor."""
    descriptor = os.open(path, flags | os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, mode)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        fcntl.flock(descriptor, fcntl.LOCK_UN)  # closing does not where a process forked meanwhile holds it, too
        os.close(descriptor)


def hash_file(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


Stored = TypeVar("Stored", bound=StrictModel)


def read_stored(path: Path, kind: type[Stored]) -> Stored | None:
    """A stored model, or None where the file is missing or damaged."""
    try:
        return kind.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None


def parse_object(text: bytes) -> dict[str, Any] | None:
    """The object of a JSON text; None where it is damaged, or something else."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


def read_bytes(path: Path) -> bytes | None:
    """A file as it was written, or None where it is missing."""
    try:
        return path.read_bytes()
    except OSError:
        return None


def write_stored(path: Path, model: StrictModel) -> None:
    write_atomically(path, model.model_dump_json(indent=1).encode())
