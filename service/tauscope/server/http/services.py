"""The services that the routes use: opened with the data folder, and closed in order."""

import logging
import shutil
import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import timedelta
from functools import partial
from typing import Annotated, Any, cast

from anyio import CapacityLimiter
from fastapi import Depends, Request
from pydantic import BaseModel

from tauscope.errors import NotFoundError, TauscopeError
from tauscope.server.auth.audit_log import AuditLog, AuditTrail
from tauscope.server.auth.gate import Access, RateLimit
from tauscope.server.auth.keys import CHECK_S, KeyFile, KeyRing
from tauscope.server.control.campaign import CampaignDependencies, CampaignManager
from tauscope.server.control.leases import DeviceClaims, Lease, Leases
from tauscope.server.control.run import start_control
from tauscope.server.control.run_manager import RunManager, StartControl
from tauscope.server.history.indexer import Indexer, open_index
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.history.model_registry import DriftMonitor, ModelRegistry
from tauscope.server.history.retention import RetentionRule, sweep
from tauscope.server.http.bodies import read_document
from tauscope.server.http.metrics import Metrics, ModelDrift, TimedExecutor
from tauscope.server.http.readiness import Clock, Heartbeat, Readiness, check_database, check_disk
from tauscope.server.http.reading import WIDTH, ReadingQueue
from tauscope.server.http.repeated_requests import StoredAnswers
from tauscope.server.http.settings import Settings
from tauscope.server.http.tasks.event_feeds import EventFeeds
from tauscope.server.problems import ProblemError
from tauscope.server.queue.analyses import HEAVY, TASKS, IdentificationWorkspace
from tauscope.server.queue.cluster_executor import ClusterExecutor, open_executor
from tauscope.server.queue.housekeeping import Housekeeping
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.queue.task_job import perform_job
from tauscope.server.queue.worker_pool import WorkerPool
from tauscope.server.schedules.repository import ScheduleRepository
from tauscope.server.schedules.scheduler import Repeater, Scheduler, new_boot
from tauscope.server.store.data_folder import FOLDERS, FolderLock, ItemStore, item_stores, site_identifier
from tauscope.server.store.database.database import Database
from tauscope.server.store.database.index import Index
from tauscope.server.store.recordings import RecordingStore
from tauscope.server.store.robots import RobotStore, hash_robot

_log = logging.getLogger("tauscope.jobs")


@dataclass(frozen=True)
class Services:
    settings: Settings
    recordings: RecordingStore
    robots: RobotStore
    items: Mapping[str, ItemStore]
    kinds: Mapping[str, JobKind]
    jobs: JobQueue
    runs: RunManager
    campaigns: CampaignManager
    reading: ReadingQueue
    access: Access
    leases: Leases
    audit: AuditTrail
    answers: StoredAnswers
    metrics: Metrics
    readiness: Readiness
    heartbeat: Heartbeat
    index: Indexer
    models: ModelRegistry
    schedules: Scheduler
    closing: threading.Event
    feeds: EventFeeds
    followers: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(4))

    def judge_new(self) -> None:
        """Judge every identification: one that ended a moment ago may become the active model."""
        self.index.refresh()
        self.models.judge_new()

    def begin_to_close(self) -> None:
        """Stop every arm, and let go of whoever follows events; returns at once."""
        self.closing.set()
        self.campaigns.begin_close()
        self.runs.begin_close()


async def _services_of(request: Request) -> Services:
    """The services of the application that answers; a coroutine, so that no thread has to be free for it."""
    return cast(Services, request.app.state.services)


ServicesDep = Annotated[Services, Depends(_services_of)]  # the services, as an argument of a route


def document_of(kind: type[BaseModel]) -> Any:
    """The JSON body of a request, as an argument of a route: the framework would read one of any size."""

    async def read(request: Request, services: ServicesDep) -> BaseModel:
        return await read_document(request, kind, services.settings.max_document_bytes)

    return Depends(read)


PRUNING_S = 3600.0  # how often what is old is removed, where the operator asked for it [s]
DAY_S = 86400.0
REQUESTS_PER_S = 200.0  # how often a key may call in the long run, where the operator says nothing [1/s]


@contextmanager
def open_services(
    settings: Settings, executor: Executor | None = None, start: StartControl | None = None
) -> Iterator[Services]:
    """Take the data folder; end all work on leaving. Raises TauscopeError if the folder or database is unusable."""
    settings.data_folder.mkdir(0o700, parents=True, exist_ok=True)
    access = _open_access(settings)
    with ExitStack() as stack:
        stack.callback(FolderLock(settings.data_folder).release)
        site, database = site_identifier(settings.data_folder), Database(settings.database_address)
        stack.callback(database.close)
        readers = open_readers(settings)
        services = _assemble(settings, access, database, site, executor, readers, start)
        drift = DriftMonitor(services.models.history, site)
        _watch(services, drift)
        housekeeping = Housekeeping(
            [services.jobs.settle, services.runs.settle, services.index.sync, services.models.judge_new, drift.look]
        )
        keys = Housekeeping([services.access.ring.look], CHECK_S)
        clock = Housekeeping([services.schedules.tick])  # apart: an interlock may take its time
        pruning = Housekeeping(_retention(services), PRUNING_S)
        filling = threading.Thread(target=_fill_index, args=(services,), name="index", daemon=True)
        filling.start()
        filling.join(FILLING_S)
        housekeeping.start()
        pruning.start()
        if settings.fires_schedules:
            clock.start()
        # Closed from the last one to the first.
        for close in (housekeeping.close, filling.join, services.index.close):
            stack.callback(close)
        stack.callback(readers.shutdown, cancel_futures=True)
        stack.callback(services.jobs.close)
        with services.audit.writing():
            services.audit.note("service", "began")
            keys.start()
            try:
                yield services
            finally:
                services.begin_to_close()
                for part in (keys, clock, pruning, services.runs, services.campaigns):
                    part.close()
                services.audit.note("service", "ended")


FILLING_S = 1.0
"""How long a start waits for the index; of a large folder that was never indexed it goes on beside the service [s]."""


def _fill_index(services: Services) -> None:
    """Index what is there, and judge its models; what fails is tried again by the housekeeping."""
    try:
        services.index.sync()
        services.models.judge_new()
    except (TauscopeError, OSError) as error:
        _log.warning("the index is not filled: %s; it is tried again", error)


def _assemble(
    settings: Settings,
    access: Access,
    database: Database,
    site: str,
    executor: Executor | None,
    readers: Executor,
    start: StartControl | None,
) -> Services:
    """Everything that the routes work with; nothing of it moves yet, and unfinished analysis goes on."""
    items, metrics, heartbeat = item_stores(settings.data_folder), Metrics(), Heartbeat()
    recordings = RecordingStore(settings.recordings_folder)
    recordings.tidy()
    kinds = {
        noun: JobKind(items[noun], partial(perform_job, kind, settings.recordings_folder), is_heavy=noun in HEAVY)
        for noun, kind in TASKS.items()
    }
    pool = executor or open_executor(settings.workers, deadline_s=settings.job_timeout_s)
    bounds: dict[str, Any] = {"slots": settings.workers, "most_waiting": settings.max_waiting}
    if isinstance(pool, ClusterExecutor):  # it comes and goes, and so do its workers
        bounds |= {"slots": lambda: pool.width, "is_there": pool.is_there}
    timed = TimedExecutor(pool, metrics.job_seconds)
    jobs = JobQueue([*kinds.values()], timed, most_each=settings.max_jobs_per_caller, **bounds)
    audit = AuditTrail(AuditLog(settings.data_folder))
    claims, closing = DeviceClaims(settings.max_arms), threading.Event()

    def note_end(lease: Lease, why: str) -> None:
        audit.note("service", "lease ended", subject=lease.id, device=lease.device, holder=lease.holder, reason=why)

    leases = Leases(claims, on_end=note_end)
    start = start or partial(start_control, sim_socket=settings.sim_socket)
    runs = RunManager(items["run"], recordings, start, claims, heartbeat.is_alive, metrics.run_ended)
    dependencies = CampaignDependencies(jobs, kinds, runs, recordings)
    campaigns = CampaignManager(items["campaign"], dependencies)

    def check_workers() -> str | None:
        if not jobs.can_work():
            return "the Dask cluster does not answer, and jobs wait for it"
        return readers.obstacle if isinstance(readers, WorkerPool) else None

    checks = {
        "service": lambda: "the service is ending" if closing.is_set() else None,
        "database": partial(check_database, database.check),
        "disk": partial(check_disk, settings.data_folder),
        "workers": check_workers,
        "clock": Clock().check,
        "audit log": lambda: f"{audit.lost} entries of the audit log were lost" if audit.lost else None,
    }
    # What a schedule moves has no lease: it waits for its next time where somebody has one.
    repeater = Repeater(dependencies, campaigns, partial(leases.permit, token=None, owner="schedule", is_needed=False))
    return Services(
        settings=settings,
        recordings=recordings,
        robots=RobotStore(settings.data_folder / "robots"),
        items=items,
        kinds=kinds,
        jobs=jobs,
        runs=runs,
        campaigns=campaigns,
        reading=ReadingQueue(readers),
        access=access,
        leases=leases,
        audit=audit,
        answers=StoredAnswers(settings.data_folder / "idempotency"),
        metrics=metrics,
        readiness=Readiness(checks),
        closing=closing,
        feeds=EventFeeds(closing),
        heartbeat=heartbeat,
        index=open_index(Index(database, site), items, recordings, settings.data_folder.name),
        models=ModelRegistry(ModelHistory(database), site, items),
        schedules=Scheduler(ScheduleRepository(database, site, new_boot()), repeater, settings.data_folder),
    )


def open_readers(settings: Settings) -> Executor:
    return WorkerPool(WIDTH, deadline_s=settings.reading_timeout_s, memory_bytes=settings.reading_memory_bytes)


def _retention(services: Services) -> list[Callable[[], object]]:
    settings, jobs = services.settings, services.jobs
    if settings.prune_older_than_days is None:
        return []
    kinds = frozenset(settings.prune_kinds or FOLDERS)
    rule = RetentionRule(timedelta(days=settings.prune_older_than_days), kinds, settings.prune_recordings)
    removers: dict[str, Callable[[str], object]] = {
        **{name: partial(jobs.cancel_or_remove, kind) for name, kind in services.kinds.items()},
        "run": services.runs.remove,
        "campaign": services.campaigns.remove,
    }

    def note(kind: str, name: str) -> None:
        services.audit.note("service", "pruned", subject=name, kind=kind)

    def prune() -> None:
        # What was not judged yet may become the active model, which stays.
        services.index.sync()
        services.models.judge_new()
        sweep(rule, services.index, services.models.history, services.recordings, removers, note)

    return [prune]


def _watch(services: Services, drift: DriftMonitor) -> None:
    metrics, folder = services.metrics, services.settings.data_folder
    metrics.loops.live = services.runs.list_live
    metrics.registry.register(ModelDrift(drift))
    metrics.watch_readiness(services.readiness.checks)
    metrics.watch("tauscope_jobs_waiting", "Jobs that wait", services.jobs.waiting)
    metrics.watch("tauscope_leases", "Leases that hold", lambda: len(services.leases.active()))
    metrics.watch("tauscope_audit_lost", "Entries that the audit log did not take", lambda: services.audit.lost)
    metrics.watch("tauscope_disk_free_bytes", "Room in the data folder", lambda: shutil.disk_usage(folder).free)


def _open_access(settings: Settings) -> Access:
    """The keys of the data folder; strangers find no service without keys at an address that they can reach."""
    ring = KeyRing(KeyFile(settings.data_folder), is_required=not settings.is_local)
    if not settings.is_local and not ring.has_valid_key():
        hint = "make a key first (tauscope key add), or listen at 127.0.0.1"
        raise TauscopeError(f"host {settings.host!r}: others could reach it, and there is no valid API key; {hint}")
    rate = settings.requests_per_s or REQUESTS_PER_S
    uploads = RateLimit(settings.max_bytes_per_day / DAY_S, settings.max_bytes_per_day)
    limits_local = settings.requests_per_s is not None
    return Access(ring, RateLimit(rate, 2.0 * rate), limits_local=limits_local, uploads=uploads)


def require_data_folder(settings: Settings) -> None:
    """Raises TauscopeError if the folder cannot be used, another service has it, or a key is needed."""
    folder = settings.data_folder
    try:
        folder.mkdir(0o700, parents=True, exist_ok=True)
        FolderLock(folder).release()
        _open_access(settings)
    except OSError as error:
        text = f"{folder}: cannot be used as data folder ({error.strerror}); name a folder that can be written to"
        raise TauscopeError(text) from None


def require_no_model(services: Services, identifier: str) -> None:
    services.judge_new()
    _require_free(services, identifier, {identifier})


def require_no_evidence(services: Services, recording: str) -> None:
    """Raises ProblemError if an active model or a reference was made from or judged by a recording."""
    services.judge_new()
    _require_free(services, recording, services.index.index.list_users(recording))


def require_no_identification(services: Services, version: str) -> None:
    """Raises ProblemError if an active model or a reference was identified with a robot."""
    services.judge_new()
    users = set()
    for identifier in services.models.history.list_protected():
        with suppress(NotFoundError):  # of another service
            workspace = IdentificationWorkspace(services.items["identification"].folder(identifier))
            order = workspace.read_order()
            if order is not None and hash_robot(workspace.robot, order.robot_file) == version:
                users.add(identifier)
    _require_free(services, version, users)


def _require_free(services: Services, name: str, users: Collection[str]) -> None:
    models = services.models.history.list_protected().intersection(users)
    if models:
        hint = "make another model active, and the reference, first; identify again where there is no other"
        raise ProblemError("in-use", f"{name}: model {min(models)} is in use and rests on it; {hint}")
