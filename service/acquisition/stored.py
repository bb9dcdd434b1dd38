"""What a run keeps as JSON: strict models, and files that are there as a whole or not at all."""

import os
import tempfile
from pathlib import Path

from pydantic import BaseModel, ConfigDict


class StoredModel(BaseModel):
    """Base of what runs keep as JSON: no type is converted, no key is overlooked."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


def replace_file(path: Path, content: bytes) -> None:
    """Write or replace a file; a reader sees the old content or the new, also after a crash.

    Parameters
    ----------
    path : Path
        the file; its folder has to exist
    content : bytes
        the whole content

    Raises
    ------
    OSError
        the disk does not take it; the old content stands
    """
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=".part-")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
