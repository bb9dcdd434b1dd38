"""Reading a user's small text file: regular, of bounded size, UTF-8."""

import stat
from pathlib import Path

from tauscope.errors import RobotFileError


def read_bounded(path: Path, limit: int) -> bytes:
    """All bytes of a regular file. Raises RobotFileError where it is none, empty, too large or not readable."""
    try:
        mode, data = path.stat().st_mode, None
        if stat.S_ISREG(mode):  # a pipe or a device might never end
            with path.open("rb") as file:
                data = file.read(limit + 1)
    except FileNotFoundError:
        raise RobotFileError(f"{path}: no such file; check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise RobotFileError(f"{path}: cannot be read: {reason}") from error
    if data is None:
        kind = "a directory" if stat.S_ISDIR(mode) else "not a regular file"
        raise RobotFileError(f"{path}: is {kind}; give the path of a file")
    if not data:
        raise RobotFileError(f"{path}: the file is empty")
    if len(data) > limit:
        raise RobotFileError(f"{path}: the file is larger than {limit // 1024} KiB; is it the right file?")
    return data


def decode_utf8(data: bytes, label: str) -> str:
    """Text of UTF-8 bytes, without a byte order mark. Raises RobotFileError if the bytes are not UTF-8."""
    try:
        return data.decode("utf-8").removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = data[error.start]
        raise RobotFileError(f"{label}:{line}: byte 0x{byte:02x} is not UTF-8 text; save the file as UTF-8") from None
