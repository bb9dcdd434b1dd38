"""What the routes work with, made once an application."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Annotated, cast

from fastapi import Depends, Request

from service.api.settings import Settings
from service.errors import TauscopeError
from service.jobs import JobQueue, WorkerPool, run_identification
from service.store import FolderLock, ItemStore, RecordingStore


@dataclass(frozen=True)
class Services:
    """What the routes work with.

    settings : Settings
        of the operator
    recordings : RecordingStore
        recordings on the server
    identifications : ItemStore
        folders of the jobs
    jobs : JobQueue
        waiting and running identifications
    checks : Executor
        where uploaded recordings are looked into
    """

    settings: Settings
    recordings: RecordingStore
    identifications: ItemStore
    jobs: JobQueue
    checks: Executor


@contextmanager
def open_services(settings: Settings, executor: Executor | None = None) -> Iterator[Services]:
    """Take the data folder, and end all work on leaving.

    Parameters
    ----------
    settings : Settings
        of the operator
    executor : Executor or None
        where the work is done; processes of our own where None

    Raises
    ------
    TauscopeError
        if another service works with the data folder
    """
    settings.data_folder.mkdir(parents=True, exist_ok=True)
    lock = FolderLock(settings.data_folder)
    recordings = RecordingStore(settings.recordings_folder)
    recordings.tidy()
    identifications = ItemStore(settings.identifications_folder, "identification")
    jobs = JobQueue(
        identifications,
        partial(run_identification, server_recordings=settings.recordings_folder),
        executor or WorkerPool(settings.workers),
        slots=settings.workers,
        most_waiting=settings.max_waiting,
    )
    checks = executor or WorkerPool(1)
    try:
        yield Services(settings, recordings, identifications, jobs, checks)
    finally:
        jobs.close()
        checks.shutdown(wait=True, cancel_futures=True)
        lock.release()


def require_data_folder(settings: Settings) -> None:
    """Make the data folder, and refuse one that cannot be worked with.

    Parameters
    ----------
    settings : Settings
        of the operator

    Raises
    ------
    TauscopeError
        if it cannot be made or written to, or another service works with it
    """
    folder = settings.data_folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
        FolderLock(folder).release()
    except OSError as error:
        text = f"{folder}: cannot be used as data folder ({error.strerror}); name a folder that can be written to"
        raise TauscopeError(text) from None


def _services_of(request: Request) -> Services:
    """The services of the application that answers."""
    return cast(Services, request.app.state.services)


Offered = Annotated[Services, Depends(_services_of)]
"""The services, as an argument of a route."""
