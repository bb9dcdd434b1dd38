"""How a worker process does a job of any kind: it tells its steps, stops when asked to, and ends with a reason."""

from collections.abc import Callable
from pathlib import Path

from tauscope.errors import TauscopeError
from tauscope.files import is_disk_full
from tauscope.server.queue.job_folder import Workspace
from tauscope.server.queue.record import JobProblem, without_folders

STORAGE_FULL = JobProblem(
    code="storage-full", detail="the service's disk was full; remove recordings or items, and hand the job in again"
)


class StoppedError(Exception):
    """The job was cancelled; nobody waits for its result."""


def do_work(workspace: Workspace, work: Callable[[], None], *folders: Path) -> JobProblem | None:
    """Do the work of a job, and say why it has no result.

    Returns JobProblem or None: why there is no result; None where there is one.
    """
    try:
        work()
    except StoppedError:
        return JobProblem(code="cancelled", detail="the job was cancelled")
    except TauscopeError as error:
        return JobProblem(code=error.code, detail=without_folders(str(error), *folders, workspace.folder))
    except OSError as error:
        if not is_disk_full(error):
            raise
        return STORAGE_FULL
    return None


def begin_step(workspace: Workspace, step: str) -> None:
    """Tell a step, unless nobody wants to know any more. Raises StoppedError if the job was cancelled."""
    require_wanted(workspace)
    workspace.write_step(step)


def require_wanted(workspace: Workspace) -> None:
    """Stop a job that was cancelled. Raises StoppedError if it was."""
    if workspace.is_asked_to_stop():
        raise StoppedError
