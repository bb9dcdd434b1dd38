"""Plain data that jobs keep as JSON files: strict, written as a whole, and read back or found damaged."""

import json
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from tauscope.files import write_atomically
from tauscope.strict_model import StrictModel

Stored = TypeVar("Stored", bound=StrictModel)


def read_stored(path: Path, kind: type[Stored]) -> Stored | None:
    """A stored model, or None where the file is missing or damaged."""
    try:
        return kind.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None


def write_stored(path: Path, model: StrictModel) -> None:
    """Keep a model."""
    write_atomically(path, model.model_dump_json(indent=1).encode())


def read_document(path: Path, schema: str) -> bytes | None:
    """A JSON document as it was written, or None where the file is missing, damaged or of another schema."""
    try:
        content = path.read_bytes()
        document = json.loads(content)
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(document, dict) and document.get("schema") == schema else None


def read_bytes(path: Path) -> bytes | None:
    """A file as it was written, or None where it is missing."""
    try:
        return path.read_bytes()
    except OSError:
        return None
