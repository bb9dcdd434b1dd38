"""One life of a service: it starts on what the last one left, meets faults, and is killed or ends."""

import multiprocessing
import os
import random
import signal
import sqlite3
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fastapi import FastAPI
from sqlalchemy import Connection, event

from reliability.cheap_work import cheap_identification
from reliability.damage import damage_something
from reliability.faulty_disk import FaultyDisk, die, full
from reliability.judgement import Judge
from reliability.ledger import Ledger
from reliability.requests import Note, Requests
from server.conftest import connected
from tauscope.server.http import Settings, create_app
from tauscope.server.http import services as http_services
from tauscope.server.http.services import Services
from tauscope.server.queue import worker_pool
from tauscope.server.store.database import database as database_engine
from tauscope.server.store.database.database import FILE_NAME

FULL, LOCKED, DAMAGED, WORKER = "disk full", "database locked", "file damaged", "worker killed"
KILLED_STARTING, KILLED_WRITING, KILLED_ANY_TIME = "killed while starting", "killed at a write", "killed at any time"
ENDED = "ended in good order"

LOCK_PATIENCE_S = 0.2
"""Little, for a lock that does not end; more than the service's own threads ever wait for each other [s]."""


@dataclass(frozen=True)
class Plan:
    """What a life brings: its faults, its end, and whether work is done in processes or in threads."""

    seed: str
    faults: tuple[str, ...]
    end: str
    in_processes: bool


def draw_plan(seed: str) -> Plan:
    """A life at random."""
    chance = random.Random(seed)
    in_processes = chance.random() < 0.3
    kinds = (FULL, FULL, LOCKED, DAMAGED, WORKER, WORKER) if in_processes else (FULL, FULL, FULL, LOCKED, DAMAGED)
    faults = tuple(chance.choice(kinds) for _ in range(chance.randrange(6)))
    end = chance.choice((KILLED_STARTING, KILLED_WRITING, KILLED_WRITING, KILLED_ANY_TIME, KILLED_ANY_TIME, ENDED))
    return Plan(seed, faults, end, in_processes)


class Life:
    """The service's process; `note` tells who started it what happens."""

    def __init__(self, folder: Path, plan: Plan, ledger: Ledger, note: Note) -> None:
        self._folder, self._plan, self._ledger, self._note = folder, plan, ledger, note
        self._chance = random.Random(f"{plan.seed} life")
        self._disk = FaultyDisk(folder)
        self._fate = folder.parent / "fate"
        global _present  # noqa: PLW0603 - work is handed to processes by the name of a function of a module
        _present = self
        self._service = os.getpid()
        self._meetings: dict[str, Callable[[Requests, Services], bool]] = {
            FULL: self._fill_disk,
            LOCKED: self._lock_database,
            DAMAGED: self._damage_file,
            WORKER: self._kill_worker,
        }

    def live(self) -> None:
        """From the start to the end."""
        self._disk.install()
        self._fate.unlink(missing_ok=True)
        if self._plan.end == KILLED_STARTING:
            self._disk.arm(die, self._chance.randrange(60), lasts=True)
        app = self._application()
        with connected(app) as client:
            services: Services = app.state.services
            requests = Requests(client, self._ledger, self._note, self._chance)
            judge = Judge(requests, services, self._ledger, self._note)
            judge.check()
            judge.check_ends_told()
            for kind in self._plan.faults:
                requests.some(self._chance.randrange(2))
                requests.is_faulty = True
                is_met = self._meetings[kind](requests, services)
                requests.is_faulty = False
                judge.check()
                if is_met and not self._is_fate_left():
                    self._note("met", kind, "")
            self._end(requests)

    def _application(self) -> FastAPI:
        """The service as it is, but for what takes time: cheap work, and no patience with a locked database."""
        http_services.perform_job = partial(cheap_identification, fate=_meet_fate)
        database_engine.TIMEOUT_S = LOCK_PATIENCE_S
        event.listen(database_engine.Engine, "begin", self._bound_pages)
        settings = Settings(data_folder=self._folder, fires_schedules=False, max_waiting=50)
        return create_app(settings, self._executor())

    def _executor(self) -> Executor:
        """Threads are quick to begin; processes are those of the service, but forked."""
        if not self._plan.in_processes:
            return ThreadPoolExecutor(1)
        context = multiprocessing.get_context("fork")
        worker_pool.get_context = lambda _method=None: context
        return worker_pool.WorkerPool(1)

    def meet_fate(self) -> None:
        """Called by the work: in a process of its own it may be killed, at a step that was drawn."""
        if os.getpid() == self._service:
            return
        self._disk.disarm()
        if self._fate.exists():
            steps = int(self._fate.read_text())
            self._fate.unlink()
            self._disk.arm(die, steps, lasts=True)

    def _fill_disk(self, requests: Requests, _: Services) -> bool:
        """From some step on nothing is written any more, or one write is refused."""
        self._note("excuse", "storage-full", "")
        self._disk.arm(full, self._chance.randrange(15), lasts=self._chance.random() < 0.6)
        requests.some(self._chance.randrange(1, 3))
        self._disk.disarm()
        return self._disk.has_struck

    def _bound_pages(self, connection: Connection) -> None:
        """On a full disk a database does not grow."""
        pages = 1 if self._disk.is_full else 2**30
        connection.exec_driver_sql(f"PRAGMA max_page_count = {pages}")

    def _lock_database(self, requests: Requests, _: Services) -> bool:
        """Somebody else writes to the database, and does not come to an end."""
        other = sqlite3.connect(self._folder / FILE_NAME, isolation_level=None, timeout=20)
        try:
            other.execute("BEGIN IMMEDIATE")
            requests.some(self._chance.randrange(1, 3))
            other.execute("ROLLBACK")
        finally:
            other.close()
        return True

    def _damage_file(self, requests: Requests, _: Services) -> bool:
        """A file of something that is kept is not what it was."""
        requests.some(self._chance.randrange(2))
        is_met = damage_something(self._folder, self._ledger, self._note, self._chance)
        requests.some(self._chance.randrange(2))
        return is_met

    def _kill_worker(self, requests: Requests, _: Services) -> bool:
        """The process that works on a job is killed at a write, or before its first one."""
        self._note("excuse", "worker-lost", "")
        self._fate.write_text(str(self._chance.randrange(8)))
        requests.hand_in()
        requests.some(self._chance.randrange(2))
        return True

    def _is_fate_left(self) -> bool:
        """Whether the job that was to meet it was never begun: then no later one shall."""
        is_left = self._fate.exists()
        self._fate.unlink(missing_ok=True)
        return is_left

    def _end(self, requests: Requests) -> None:
        """How the life ends."""
        if self._plan.end == ENDED:
            requests.some(self._chance.randrange(3))
            return
        if self._plan.end == KILLED_WRITING:
            self._disk.arm(die, self._chance.randrange(40), lasts=True)
        self._note("last", self._plan.end, "")
        requests.some(self._chance.randrange(1, 5))
        if self._plan.end == KILLED_ANY_TIME:
            signal.pause()  # whoever started us kills us, perhaps before it comes to this
        die()


_present: Life | None = None
"""The life of this process and of those that it forks."""


def _meet_fate() -> None:
    """Called by the work when it begins."""
    assert _present is not None
    _present.meet_fate()
