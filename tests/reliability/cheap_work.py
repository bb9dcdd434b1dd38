"""Stands for an identification: the same reading, steps and writing, and no mathematics."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tauscope.errors import RecordingError, TauscopeError
from tauscope.files import write_atomically
from tauscope.server.queue.analyses import IdentificationWorkspace
from tauscope.server.queue.job_folder import JobProblem, begin_step, do_work
from tauscope.server.queue.task_job import TaskWorkspace, perform_job
from tauscope.server.store.files import hash_file

SCHEMA = "tauscope.identification/1"


def cheap_identification(
    kind: type[TaskWorkspace[Any]], server_recordings: Path, folder: Path, fate: Callable[[], None]
) -> JobProblem | None:
    """Write down what the recordings of the order hold; `fate` may have the process killed meanwhile."""
    if kind is not IdentificationWorkspace:
        return perform_job(kind, server_recordings, folder)
    fate()
    workspace = IdentificationWorkspace(folder)

    def work() -> None:
        order = workspace.read_order()
        if order is None:
            raise TauscopeError("the job's order.json is missing or damaged; hand the identification in again")
        begin_step(workspace, "read robot and recordings")
        for entry in order.recordings:
            path = server_recordings / entry.name
            if not path.is_file() or hash_file(path) != entry.sha256:
                raise RecordingError(f"{entry.name}: was changed or removed after the job was handed in")
        begin_step(workspace, "write result and exports")
        content = {"schema": SCHEMA, "made_from": [entry.sha256 for entry in order.recordings]}
        write_atomically(workspace.folder / "result.json", json.dumps(content, indent=1).encode())

    return do_work(workspace, work, server_recordings)
