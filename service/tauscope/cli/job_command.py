"""``tauscope job``: a schedule done now, by the service that is there or by this process."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from pydantic import SecretStr
from typer import Argument, Option

from tauscope.cli.store_command import DatabaseUrl, DataFolder, open_database
from tauscope.cli.terminal import output, say, table
from tauscope.cli.verbs import make_group
from tauscope.errors import StoreError, TauscopeError
from tauscope.number_text import ABSENT
from tauscope.report.tables import Table
from tauscope.server.http.services import open_services
from tauscope.server.http.settings import Settings, default_data_folder
from tauscope.server.schedules.repository import FiringEntry, ScheduleRepository
from tauscope.server.schedules.scheduler import new_boot
from tauscope.server.store.data_folder import FolderLock, site_identifier, utc_now

POLL_S = 0.5  # how often the end is looked for [s]
PATIENCE_S = 30.0  # how long a service may take to take it on [s]
GOOD_ENDS = ("succeeded", "finished")


def run_job(
    name: Annotated[str, Argument(metavar="NAME", help="Name of the schedule.")],
    data: DataFolder = None,
    database: DatabaseUrl = None,
    timeout_s: Annotated[float, Option("--timeout", min=1.0, metavar="S", help="Longest wait for its end [s].")] = 6
    * 3600.0,
) -> None:
    """Do what a schedule repeats now, and wait for its end: for systemd timers, cron and Kubernetes.

    A service that works with the data folder does it; where there is none, this command does. Exit status 0 where it
    succeeded; 1, with the reason, where it failed or nothing was started. Nothing is repeated by itself.
    """
    folder = data or default_data_folder()
    if not folder.is_dir():
        raise StoreError(f"{folder}: there is no such data folder; name it with --data")
    secret = None if database is None else SecretStr(database)
    settings = Settings(data_folder=folder, database=secret, fires_schedules=False)
    if _is_free(folder):
        with open_services(settings) as services:
            firing = services.schedules.fire_now(name)
            number = firing.number

            def look() -> FiringEntry:
                services.index.sync()
                return services.schedules.repository.firing(number)

            firing = _follow(firing, look, timeout_s)
    else:
        firing = _ask_service(name, folder, database, timeout_s)
    _tell(name, firing)


def list_jobs(data: DataFolder = None, database: DatabaseUrl = None) -> None:
    """Show all schedules, and what came of each the last time."""
    rows = []
    with open_database(data, database) as opened:
        book = ScheduleRepository(opened, "", "")
        for entry in book.schedules():
            last = next(iter(book.firings(entry.name, 1)), None)
            due = ABSENT if entry.next_due is None else f"{entry.next_due:%Y-%m-%d %H:%M} UTC"
            rows.append((entry.name, str(entry.definition.get("kind")), due, _outcome(last)))
    output().print(table("Schedules", Table(("name", "what", "due next", "the last time"), rows, words=4)))


def _is_free(folder: Path) -> bool:
    try:
        FolderLock(folder).release()
    except TauscopeError:
        return False
    return True


def _ask_service(name: str, folder: Path, database: str | None, timeout_s: float) -> FiringEntry:
    with open_database(folder, database) as opened:
        book = ScheduleRepository(opened, site_identifier(folder), new_boot())
        number = book.ask(name, utc_now())
        deadline = time.monotonic() + PATIENCE_S
        while book.firing(number).state == "asked" and time.monotonic() < deadline:
            time.sleep(POLL_S)
        if book.withdraw(number):
            text = f"schedule {name}: no service took it on within {PATIENCE_S:g} s"
            raise StoreError(f"{text}; is the service of its site up, and does it fire schedules?")
        return _follow(book.firing(number), lambda: book.firing(number), timeout_s)


def _follow(firing: FiringEntry, look: Callable[[], FiringEntry], timeout_s: float) -> FiringEntry:
    deadline = time.monotonic() + timeout_s
    while not firing.is_final:
        if time.monotonic() > deadline:
            text = f"schedule {firing.schedule}: has not ended within {timeout_s:g} s; it goes on"
            raise StoreError(f"{text} where a service does it, and ends with this command where not")
        time.sleep(POLL_S)
        firing = look()
    return firing


def _tell(name: str, firing: FiringEntry) -> None:
    if firing.item is None:
        raise StoreError(f"schedule {name}: {firing.state}: {firing.reason or 'nothing was started'}")
    what = f"{firing.item[0]} {firing.item[1]}"
    if firing.item_state not in GOOD_ENDS:
        raise StoreError(f"schedule {name}: {what} ended {firing.item_state}; look it up, and do what its problem says")
    say(f"schedule {name}: {what} {firing.item_state}")


def _outcome(firing: FiringEntry | None) -> str:
    if firing is None:
        return ABSENT
    if firing.item is None:
        return firing.state if firing.reason is None else f"{firing.state}: {firing.reason}"
    return f"{firing.item[0]} {firing.item[1]} {firing.item_state or 'goes on'}"


job = make_group(run=run_job, list=list_jobs)
