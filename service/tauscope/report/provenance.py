"""What a result was made from: enough to make it again, and to notice that a file has changed since."""

import hashlib
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version

from tauscope.errors import RecordingError, explain_os_errors
from tauscope.remote_files import copy_locally, find_path, is_folder, name_failures

LIBRARIES = ("tauscope", "numpy", "scipy", "clarabel")  # packages whose version can change a figure


@dataclass(frozen=True)
class InputFile:
    """One file that was read."""

    role: str
    path: str
    size_bytes: int
    sha256: str  # of its bytes, in hexadecimal


@dataclass(frozen=True)
class Provenance:
    """Where a result comes from."""

    command: tuple[str, ...]
    inputs: tuple[InputFile, ...]
    versions: tuple[tuple[str, str], ...]  # tuple of (str, str), name and version of what computed it
    created: datetime


def versions() -> tuple[tuple[str, str], ...]:
    """Name and version of what can change a figure."""
    return (("Python", platform.python_version()), *((name, installed_version(name)) for name in LIBRARIES))


def installed_version(package: str) -> str:
    """Version of an installed package."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


def input_files(role: str, path: str) -> Iterator[InputFile]:
    """The file of a path, or the files in it where it is a folder. Raises RecordingError where it cannot be read."""
    source = find_path(path)
    with explain_os_errors(RecordingError, f"{path}: cannot be read again for its hash"):
        files = sorted(entry for entry in source.iterdir() if entry.is_file()) if is_folder(source) else [source]
        for file in files:
            with name_failures(file), copy_locally(file) as copy, copy.open("rb") as opened:
                digest = hashlib.file_digest(opened, "sha256").hexdigest()
            yield InputFile(role, str(file), file.stat().st_size, digest)
