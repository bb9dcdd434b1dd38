"""Files that are either there as a whole or not at all, also after a crash or a power loss."""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def open_atomically(path: Path, mode: int = 0o666) -> Iterator[BinaryIO]:
    """A new file that takes its name, in place of an older one, once it is complete and its bytes are on the disk.

    `mode`: its permissions, before the account's mask.
    """
    partial = path.with_name(f".{path.name[:64]}.{secrets.token_hex(6)}.partial")
    try:
        with open(partial, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_atomically(path: Path, content: bytes) -> None:
    """Write or replace a file; a reader sees the old content or the new, never a part.

    The bytes reach the disk before the name does, and the name before this function returns.
    """
    with open_atomically(path, 0o600) as file:
        file.write(content)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def is_disk_full(error: OSError) -> bool:
    """Whether something failed for want of room: no fault of ours, and over as soon as there is room again."""
    return error.errno in (errno.ENOSPC, errno.EDQUOT)
