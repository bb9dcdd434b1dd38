"""A model that a request brings: as a file, as a document, or by the identifier of what made it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tauscope.errors import IdentificationError
from tauscope.server.http.documents import to_json_text
from tauscope.server.problems import ProblemError
from tauscope.server.queue.task_job import SAVED_MODEL, TaskWorkspace
from tauscope.server.store.files import KeptFile

MODEL_FILE = "model.json"


def keep_model(
    model: str | dict[str, Any] | None,
    file: KeptFile | None,
    workspace: TaskWorkspace[Any],
    read: Callable[[str], bytes],
) -> str | None:
    """Put a model into its place in a job's folder; returns its name there.

    Raises ProblemError where it came twice. Raises IdentificationError where it holds what JSON cannot.

    Parameters
    ----------
    model : str or dict or None
        identifier or document, as the request has it
    file : KeptFile or None
        part of the form, which lies in its place
    read : callable
        the model of an identifier
    """
    if file is not None and model is not None:
        raise ProblemError("invalid-request", "the model came twice, as part model and in part request; send it once")
    if file is not None or model is None:
        return None if file is None else file.name
    path: Path = workspace.uploads(SAVED_MODEL) / MODEL_FILE
    if isinstance(model, str):
        path.write_bytes(read(model))
        return MODEL_FILE
    text = to_json_text(model)
    if text is None:
        raise IdentificationError("model: holds NaN, infinity or text that is not Unicode; write plain numbers")
    path.write_text(text, encoding="utf-8")
    return MODEL_FILE
