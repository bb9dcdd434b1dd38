"""Files that are sent as they lie on the disk."""

from collections.abc import Mapping
from pathlib import Path

from fastapi.responses import FileResponse

_MEDIA_TYPES: Mapping[str, str] = {".csv": "text/csv", ".json": "application/json"}


def file_answer(path: Path, name: str) -> FileResponse:
    """The answer that sends a file, to be saved under a name and never shown as a page."""
    media_type = _MEDIA_TYPES.get(Path(name).suffix.lower(), "application/octet-stream")
    return FileResponse(path, media_type=media_type, filename=name)
