"""What the routes work with, made once an application."""

import threading
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, cast

from anyio import CapacityLimiter
from fastapi import Depends, Request

from service.api.pulse import Pulse
from service.api.settings import Settings
from service.errors import TauscopeError
from service.jobs import (
    CampaignDesk,
    DeviceClaims,
    JobKind,
    JobQueue,
    RunDesk,
    StartControl,
    WorkerPool,
    Workshop,
    run_diagnosis,
    run_excitation,
    run_identification,
    start_control,
)
from service.store import FolderLock, ItemStore, RecordingStore


@dataclass(frozen=True)
class Services:
    """What the routes work with.

    settings : Settings
        of the operator
    recordings : RecordingStore
        recordings on the server
    identifications, diagnoses, excitations : JobKind
        identifications, diagnoses and designed motions, each a folder
    jobs : JobQueue
        waiting and running jobs of every kind
    runs : RunDesk
        runs, each a folder
    campaigns : CampaignDesk
        campaigns, each a folder
    checks : Executor
        where uploaded recordings are looked into
    followers : CapacityLimiter
        threads that read events for those who follow them: however many follow, the other routes' threads stay free
    pulse : Pulse
        whether requests are answered: while they are not, nobody could stop a run, and no run goes on
    closing : threading.Event
        set when the service is asked to end: whoever follows events lets go
    """

    settings: Settings
    recordings: RecordingStore
    identifications: JobKind
    diagnoses: JobKind
    excitations: JobKind
    jobs: JobQueue
    runs: RunDesk
    campaigns: CampaignDesk
    checks: Executor
    pulse: Pulse
    followers: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(4))
    closing: threading.Event = field(default_factory=threading.Event)

    def begin_to_close(self) -> None:
        """Stop every arm, and let go of whoever follows events; returns at once."""
        self.closing.set()
        self.campaigns.stop_all()
        self.runs.stop_all()


@contextmanager
def open_services(
    settings: Settings, executor: Executor | None = None, start: StartControl | None = None
) -> Iterator[Services]:
    """Take the data folder, and end all work on leaving: first what moves, then the rest.

    Parameters
    ----------
    settings : Settings
        of the operator
    executor : Executor or None
        where the work is done; processes of our own where None
    start : callable or None
        starts the control process of a run; one of our own where None

    Raises
    ------
    TauscopeError
        if another service works with the data folder
    """
    settings.data_folder.mkdir(parents=True, exist_ok=True)
    lock = FolderLock(settings.data_folder)
    recordings = RecordingStore(settings.recordings_folder)
    recordings.tidy()
    identifications = JobKind(
        ItemStore(settings.identifications_folder, "identification"),
        partial(run_identification, server_recordings=settings.recordings_folder),
    )
    diagnoses = JobKind(
        ItemStore(settings.diagnoses_folder, "diagnosis"),
        partial(run_diagnosis, server_recordings=settings.recordings_folder),
    )
    excitations = JobKind(ItemStore(settings.excitations_folder, "excitation"), run_excitation)
    jobs = JobQueue(
        [identifications, diagnoses, excitations],
        executor or WorkerPool(settings.workers),
        slots=settings.workers,
        most_waiting=settings.max_waiting,
    )
    pulse = Pulse()
    claims = DeviceClaims(settings.max_arms)
    start = start or partial(start_control, sim_socket=settings.sim_socket)
    runs = RunDesk(ItemStore(settings.runs_folder, "run"), recordings, start, claims, pulse.is_felt)
    shop = Workshop(jobs, excitations, identifications, diagnoses, runs, recordings)
    campaigns = CampaignDesk(ItemStore(settings.campaigns_folder, "campaign"), shop)
    checks = executor or WorkerPool(1)
    kinds = (identifications, diagnoses, excitations)
    services = Services(settings, recordings, *kinds, jobs, runs, campaigns, checks, pulse)
    try:
        yield services
    finally:
        services.begin_to_close()
        runs.close()
        campaigns.close()
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


async def _services_of(request: Request) -> Services:
    """The services of the application that answers; a coroutine, so that no thread has to be free for it."""
    return cast(Services, request.app.state.services)


Offered = Annotated[Services, Depends(_services_of)]
"""The services, as an argument of a route."""
