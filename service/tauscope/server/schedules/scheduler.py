"""The scheduler: each firing happens once, has a definite end, and is never repeated by itself; what it starts."""

import json
import logging
import stat
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TypeVar

from tauscope.errors import NotFoundError, TauscopeError, one_line
from tauscope.server.control.campaign import CampaignDependencies, CampaignManager, CampaignOrder, CampaignWorkspace
from tauscope.server.control.leases import FREE, BusyError, LeasedError, Permit
from tauscope.server.history.indexer import WORKSPACES
from tauscope.server.queue.job_folder import Workspace, without_folders
from tauscope.server.queue.queue import QueueFullError
from tauscope.server.queue.task_job import OrderedRecording, TaskOrder, order_kept, stage_workspace, submit_job
from tauscope.server.schedules.definition import RecordingChoice, ScheduleDefinition
from tauscope.server.schedules.repository import FiringEntry, ScheduleRepository
from tauscope.server.store.data_folder import ItemStore, utc_now
from tauscope.server.store.database.tables import Schedule
from tauscope.server.store.recordings import RecordingStore
from tauscope.strict_model import StrictModel
from tauscope.tasks.run import BackendChoice

Order = TypeVar("Order", bound=StrictModel)


class NothingToDoError(TauscopeError):
    """There is no new recording: what would be found is known already."""


@dataclass(frozen=True, eq=False)
class Repeater:
    dependencies: CampaignDependencies
    campaigns: CampaignManager
    permit_for: Callable[[str], Permit] = field(default_factory=lambda: lambda _device: FREE)

    def start(self, entry: Schedule, since: datetime | None) -> tuple[str, str]:
        """Start it; returns kind and identifier. Raises NothingToDoError without a new recording, or TauscopeError."""
        definition = read_definition(entry)
        if definition.kind == "campaign":
            return "campaign", self._campaign(entry)
        assert definition.recordings is not None  # noqa: S101 - checked by the definition
        train, held_out = newest_recordings(self.dependencies.recordings, definition.recordings, since)
        return definition.kind, self._analyse(definition.kind, entry, {"recordings": train, "held_out": held_out})

    def goes_on(self, kind: str, identifier: str) -> bool:
        """Whether something that was started has not ended; what was removed has."""
        try:
            return not Workspace(self.items(kind).folder(identifier)).has_ended()
        except NotFoundError:
            return False

    def items(self, kind: str) -> ItemStore:
        return self.campaigns.items if kind == "campaign" else self.dependencies.kinds[kind].items

    def _campaign(self, entry: Schedule) -> str:
        order = _order(entry, CampaignOrder)
        with stage_workspace(self.campaigns.items, CampaignWorkspace) as workspace:
            write_robot(workspace.robot, entry)
            workspace.write_order(order)
            return self.campaigns.submit(workspace.folder, self.permit_for(order.backend.device(order.robot_name)))

    def _analyse(self, kind: str, entry: Schedule, recordings: Mapping[str, tuple[OrderedRecording, ...]]) -> str:
        order_type: type[TaskOrder] = WORKSPACES[kind].order_type
        order, jobs = _order(entry, order_type).model_copy(update=recordings), self.dependencies.jobs
        put_robot = partial(write_robot, entry=entry)
        return submit_job(jobs, self.dependencies.kinds[kind], WORKSPACES[kind], order, put_robot)


def newest_recordings(
    store: RecordingStore, choice: RecordingChoice, since: datetime | None
) -> tuple[tuple[OrderedRecording, ...], tuple[OrderedRecording, ...]]:
    """Training, then held-out recordings; the newest are held out. Raises NothingToDoError if none is new."""
    found = [entry for entry in store.entries() if fnmatchcase(entry.name, choice.pattern)]
    wanted = sorted(found, key=lambda entry: (entry.modified, entry.name))[-(choice.train + choice.held_out) :]
    if len(wanted) < choice.train + choice.held_out:
        needed = choice.train + choice.held_out
        raise NothingToDoError(f"{len(wanted)} recordings match {choice.pattern}, {needed} are needed; record more")
    if since is not None and wanted[-1].modified <= since:
        raise NothingToDoError(f"no recording that matches {choice.pattern} is newer than the last time; record more")
    names = [entry.name for entry in wanted]
    return order_kept(store, names[: choice.train]), order_kept(store, names[choice.train :])


def write_robot(folder: Path, entry: Schedule) -> None:
    for name, text in entry.files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _order(entry: Schedule, kind: type[Order]) -> Order:
    return kind.model_validate(dict(entry.order), strict=False)


def make_schedule(
    name: str, like: str, definition: ScheduleDefinition, repeater: Repeater, site: str | None, now: datetime
) -> Schedule:
    """Repeat an item, at any `site` where None. Raises NotFoundError if it is missing or damaged."""
    workspace = WORKSPACES[definition.kind](repeater.items(definition.kind).folder(like))
    order = workspace.read_order()
    if order is None:
        raise NotFoundError(f"{definition.kind} {like}: its order is missing or damaged; name another one")
    # A campaign's `held_out` is a motion, all others' names recordings.
    is_campaign = definition.kind == "campaign"
    lists = set[str]() if is_campaign else {"recordings", "held_out", "simulated", "model"}
    plain = json.loads(order.model_dump_json(exclude=lists)) | ({} if is_campaign else {"recordings": []})
    try:
        files = {path.name: path.read_text(encoding="utf-8") for path in sorted(workspace.robot.iterdir())}
    except (OSError, UnicodeDecodeError):
        text = f"{definition.kind} {like}: its robot file is missing or damaged; name another one"
        raise NotFoundError(text) from None
    due = definition.next_after(now, now)
    return Schedule(
        name=name,
        site=site,
        definition=definition.model_dump(mode="json"),
        order=plain,
        files=files,
        created=now,
        next_due=due,
    )


FOLDER = "interlocks"
TIMEOUT_S = 10.0  # how long the program may take [s]


def find_objection(data_folder: Path, name: str, robot: str, device: str) -> str | None:
    """Why an arm is not free, None where it is. Only the operator's programs in the folder are called."""
    path = data_folder / FOLDER / name
    fault = _fault(path)
    if fault is not None:
        return f"interlock {name}: {fault}"
    try:
        done = subprocess.run(  # noqa: S603 - the operator's own program, without a shell
            [str(path), robot, device],
            capture_output=True,
            timeout=TIMEOUT_S,
            check=False,
            stdin=subprocess.DEVNULL,
            cwd=data_folder,
        )
    except subprocess.TimeoutExpired:
        return f"interlock {name}: did not answer within {TIMEOUT_S:g} s"
    except OSError as error:
        return f"interlock {name}: cannot be called ({error.strerror or error})"
    if done.returncode == 0:
        return None
    said = (done.stdout.strip() or done.stderr.strip()).decode("utf-8", "replace").splitlines()
    return one_line(f"interlock {name}: {said[0] if said else f'exit status {done.returncode}'}")


def _fault(path: Path) -> str | None:
    try:
        status = path.lstat()
    except OSError:
        return f"there is no program {path.name} in the folder {FOLDER} of the data folder"
    if not stat.S_ISREG(status.st_mode) or not status.st_mode & stat.S_IXUSR:
        return "is no program: an executable file, no link, is needed"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "others may write to it; take that right away (chmod go-w)"
    return None


_log = logging.getLogger("tauscope.jobs")
_Outcome = tuple[str, str | None, tuple[str, str] | None]  # state of a firing, its reason, and what was started


class Scheduler:
    """Fires due schedules; a firing that is missed, or not possible, is recorded as such."""

    def __init__(
        self,
        repository: ScheduleRepository,
        repeater: Repeater,
        data_folder: Path,
        clock: Callable[[], datetime] = utc_now,
    ) -> None:
        """Prepare. Firings that an earlier start left undecided become `interrupted`: nothing is repeated."""
        self.repository, self.repeater, self._data_folder = repository, repeater, data_folder
        self._clock = clock
        self._unwritten: dict[int, _Outcome] = {}
        repository.interrupt_claims()

    def tick(self) -> None:
        """Do what is due, and what was asked for. Raises StoreError if the database does not answer."""
        self._write_outcomes()
        while (asked := self.repository.claim_asked(self._clock())) is not None:
            self._fire(*asked, lateness=None)
        for entry in self.repository.due(self._clock()):
            now = self._clock()
            due, definition = entry.next_due, read_definition(entry)
            number = self.repository.claim(entry, definition.next_after(now, entry.created), now)
            if number is not None and due is not None:
                self._fire(number, entry, lateness=now - due)

    def fire_now(self, name: str) -> FiringEntry:
        """Do a schedule now, in this process. Raises NotFoundError if there is no such schedule."""
        number = self.repository.ask(name, self._clock())
        claimed = self.repository.claim_asked(self._clock(), number)
        if claimed is not None:
            self._fire(*claimed, lateness=None)
        return self.repository.firing(number)

    def _fire(self, number: int, entry: Schedule, lateness: timedelta | None) -> None:
        try:
            outcome = self._outcome(entry, read_definition(entry), lateness)
        except Exception as error:
            _log.exception("schedule %s failed for an unforeseen reason", entry.name)
            outcome = "failed", f"a fault of Tauscope's own ({type(error).__name__}); see the log", None
        self._unwritten[number] = outcome
        state, reason, _ = outcome
        _log.info("schedule %s: %s%s", entry.name, state, "" if reason is None else f" ({reason})")
        self._write_outcomes()

    def _write_outcomes(self) -> None:
        """Give firings their ends; what the database does not take now it is given with the next tick."""
        for number, outcome in list(self._unwritten.items()):
            self.repository.finish(number, *outcome)
            self._unwritten.pop(number, None)

    def _outcome(self, entry: Schedule, definition: ScheduleDefinition, lateness: timedelta | None) -> _Outcome:
        if lateness is not None and self._is_too_late(entry, definition, lateness):
            minutes = lateness.total_seconds() / 60
            return "missed", f"no service looked at it until {minutes:.0f} minutes later; it is due again", None
        reason = self._find_obstacle(entry, definition)
        if reason is not None:
            return "skipped", reason, None
        try:
            firings = self.repository.firings(entry.name, 100)
            last = next((each.due for each in firings if each.state == "started"), None)
            return "started", None, self.repeater.start(entry, last)
        except (BusyError, LeasedError, QueueFullError, NothingToDoError) as error:
            return "skipped", str(error), None
        except TauscopeError as error:
            return "failed", without_folders(str(error), self._data_folder), None

    def _is_too_late(self, entry: Schedule, definition: ScheduleDefinition, lateness: timedelta) -> bool:
        """Whether no time at which it was due is near enough; of several that were missed the last one counts."""
        grace, now = timedelta(seconds=definition.grace_s), self._clock()
        if lateness <= grace:
            return False
        latest = definition.next_after(now - grace, entry.created)
        return latest is None or latest > now

    def _find_obstacle(self, entry: Schedule, definition: ScheduleDefinition) -> str | None:
        window = definition.window
        if window is not None and not definition.is_open(self._clock()):
            days = ", ".join(window.days)
            return f"outside of its window, {window.start} to {window.end} ({definition.timezone}) on {days}"
        for firing in self.repository.firings(entry.name, 10):
            if firing.item is not None and self._goes_on(firing, *firing.item):
                return f"what was started last, {firing.item[0]} {firing.item[1]}, still goes on"
        if definition.interlock is None:
            return None
        robot = str(entry.order.get("robot_name"))
        backend = BackendChoice.model_validate(entry.order.get("backend") or {}, strict=False)
        return find_objection(self._data_folder, definition.interlock, robot, backend.device(robot))

    def _goes_on(self, firing: FiringEntry, kind: str, identifier: str) -> bool:
        if firing.site == self.repository.site:
            return self.repeater.goes_on(kind, identifier)
        return firing.item_state is not None and not firing.is_final


def read_definition(entry: Schedule) -> ScheduleDefinition:
    return ScheduleDefinition.model_validate(dict(entry.definition), strict=False)


def new_boot() -> str:
    """What tells this start of the service from all others."""
    return f"{datetime.now(UTC):%Y%m%dT%H%M%S%f}"
