"""Files on object storage and web servers: ``s3://``, ``gs://``, ``https://``, read in ranges by fsspec.

fsspec's paths have the methods of `pathlib.Path`, so readers take either. Credentials are those of each service's own
tools: environment, profiles, instance roles.
"""

import logging
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from io import UnsupportedOperation
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

from tauscope.errors import RecordingError, TauscopeError
from tauscope.extras import require_extra

_URL = re.compile(r"(s3|gs|gcs|https?):/{1,2}(?=[^/])")  # `Path` drops the second slash
_PACKAGES = {"s3": "s3fs", "gs": "gcsfs", "gcs": "gcsfs"}
_LONGEST_REASON = 200
_HERE = Path()
BLOCK_BYTES = 2**17  # read ahead of scattered ranges: fsspec's own 5 MiB would load most of a file


def find_path(name: str | Path, folder: Path = _HERE) -> Path:
    """The path of a file, relative to a folder, or fsspec's path of a URL.

    Raises MissingExtraError where the extra `cloud` is not installed.
    """
    match = _URL.match(str(name))
    if match is None:
        return folder / name
    with require_extra(f"reading {match[1]}://"):
        package = _PACKAGES.get(match[1], "aiohttp")
        __import__(package)
        logging.getLogger(package).addHandler(logging.NullHandler())  # what failed is said once, in one line
        from upath import UPath
    path: Any = UPath(f"{match[1]}://{str(name)[match.end() :]}")
    return path


def is_folder(path: Path) -> bool:
    """Whether a path is a folder; a page of the web is none, and asking would load it."""
    return not str(path).startswith("http") and path.is_dir()


def open_ranges(path: Path) -> BinaryIO:
    """A file of which scattered ranges are read."""
    remote: Any = path
    return path.open("rb") if isinstance(path, Path) else remote.open("rb", block_size=BLOCK_BYTES)


def read_range(file: BinaryIO, at: int, length: int) -> bytes:
    """Bytes at a place of a file, past its buffer: a seek within a buffer would fill it anew."""
    try:
        return os.pread(file.fileno(), length, at)
    except UnsupportedOperation:
        file.seek(at)
        return file.read(length)


def knows_ranges(path: Path) -> bool:
    """Whether parts of a file can be read; some web servers send the whole file only."""
    if isinstance(path, Path):
        return True
    try:
        with open_ranges(path) as file:
            file.seek(1)
            file.read(1)
    except ValueError:
        return False
    return True


@contextmanager
def copy_locally(path: Path) -> Iterator[Path]:
    """A file as one of the disk, for libraries that read no other; the copy of a URL goes with the context."""
    if isinstance(path, Path):
        yield path
        return
    with TemporaryDirectory(prefix="tauscope-") as folder:
        path.fs.get_file(path.path, str(Path(folder) / path.name))
        yield Path(folder) / path.name


@contextmanager
def name_failures(path: Path) -> Iterator[None]:
    """Turn what a service refuses into one line. Raises RecordingError naming the URL; a file's own errors pass."""
    try:
        yield
    except TauscopeError:
        raise
    except Exception as error:
        if isinstance(path, Path):
            raise
        reason = " ".join(str(error.__cause__ or error).split())[:_LONGEST_REASON] or type(error).__name__
        if isinstance(error, FileNotFoundError) and "onnect" not in reason:
            reason = "no such file"
        elif isinstance(error, PermissionError) or "redentials" in reason:
            reason = f"no permission to read it ({reason}); sign in as the service's own tools ask for"
        raise RecordingError(f"{path}: {reason}") from error
