"""JSON bodies, of one media type, bounded and strict; and files that are sent as they lie on the disk."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from fastapi import Request
from fastapi.responses import FileResponse
from pydantic import BaseModel, ValidationError

from tauscope.errors import LimitExceededError
from tauscope.server.problems import ProblemError, invalid_request

JSON = "application/json"

Model = TypeVar("Model", bound=BaseModel)


def media_type(request: Request) -> str:
    """The media type of a request's body, without parameters."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def refuse_media_type(request: Request, *accepted: str) -> ProblemError:
    """The problem of a body of another media type."""
    found = media_type(request) or "of no stated media type"
    headers = {"Accept-Post": ", ".join(accepted)}
    return ProblemError("media-type", f"the body is {found}; send {' or '.join(accepted)}", headers=headers)


async def read_document(request: Request, kind: type[Model], limit: int) -> Model:
    """The JSON body of a request.

    Raises ProblemError if the body is not as the model wants it. Raises LimitExceededError if it is too large.

    `limit`: largest body [bytes].
    """
    content = bytearray()
    async for piece in request.stream():
        content += piece
        if len(content) > limit:
            raise LimitExceededError(f"the JSON is larger than the {limit} bytes accepted here; send files as a form")
    return parse_document(bytes(content), kind, within="body")


def parse_document(content: bytes, kind: type[Model], *, within: str) -> Model:
    """A model from JSON text. Raises ProblemError if it is not as the model wants it."""
    try:
        return kind.model_validate_json(content)
    except ValidationError as error:
        raise invalid_request(error, within=within) from None


def to_json_text(value: Any) -> str | None:
    """Plain data as JSON; None where it holds NaN or infinity, or text that is not Unicode."""
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False)
        text.encode()
    except (ValueError, RecursionError):
        return None
    return text


_MEDIA_TYPES: Mapping[str, str] = {".csv": "text/csv", ".json": "application/json"}


def file_answer(path: Path, name: str) -> FileResponse:
    """The answer that sends a file, to be saved under a name and never shown as a page."""
    media_type = _MEDIA_TYPES.get(Path(name).suffix.lower(), "application/octet-stream")
    return FileResponse(path, media_type=media_type, filename=name)
