"""The repeater: it starts what a schedule repeats, and makes schedules from items that were done once."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TypeVar

from tauscope.errors import NotFoundError, TauscopeError
from tauscope.server.control.campaign import CampaignOrder, CampaignWorkspace
from tauscope.server.control.campaign_runner import CampaignDependencies, CampaignManager
from tauscope.server.control.leases import FREE, Permit
from tauscope.server.history.indexer import WORKSPACES
from tauscope.server.queue.analyses import DiagnosisOrder, IdentificationOrder
from tauscope.server.queue.job_folder import Workspace
from tauscope.server.queue.task_job import OrderedRecording, order_kept, stage_workspace, submit_job
from tauscope.server.schedules.definition import RecordingChoice, ScheduleDefinition
from tauscope.server.schedules.repository import ScheduleEntry
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.recordings import RecordingStore
from tauscope.strict_model import StrictModel

Order = TypeVar("Order", bound=StrictModel)


class NothingToDoError(TauscopeError):
    """There is no new recording: what would be found is known already."""


@dataclass(frozen=True, eq=False)
class Repeater:
    dependencies: CampaignDependencies
    campaigns: CampaignManager
    permit_for: Callable[[str], Permit] = field(default_factory=lambda: lambda _device: FREE)

    def start(self, entry: ScheduleEntry, since: datetime | None) -> tuple[str, str]:
        """Start it; returns kind and identifier. Raises NothingToDoError without a new recording, or TauscopeError."""
        definition = ScheduleDefinition.model_validate(dict(entry.definition), strict=False)
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
        if kind == "campaign":
            return self.campaigns.items
        return (self.dependencies.identifications if kind == "identification" else self.dependencies.diagnoses).items

    def _campaign(self, entry: ScheduleEntry) -> str:
        order = _order(entry, CampaignOrder)
        with stage_workspace(self.campaigns.items, CampaignWorkspace) as workspace:
            write_robot(workspace.robot, entry)
            workspace.write_order(order)
            return self.campaigns.submit(workspace.folder, self.permit_for(order.backend.device(order.robot_name)))

    def _analyse(self, kind: str, entry: ScheduleEntry, recordings: Mapping[str, tuple[OrderedRecording, ...]]) -> str:
        is_diagnosis = kind == "diagnosis"
        order = _order(entry, DiagnosisOrder if is_diagnosis else IdentificationOrder).model_copy(update=recordings)
        job = self.dependencies.diagnoses if is_diagnosis else self.dependencies.identifications
        return submit_job(self.dependencies.jobs, job, WORKSPACES[kind], order, partial(write_robot, entry=entry))


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


def write_robot(folder: Path, entry: ScheduleEntry) -> None:
    for name, text in entry.files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _order(entry: ScheduleEntry, kind: type[Order]) -> Order:
    return kind.model_validate(dict(entry.order), strict=False)


def make_schedule(
    name: str, like: str, definition: ScheduleDefinition, repeater: Repeater, site: str | None, now: datetime
) -> ScheduleEntry:
    """Repeat an item, at any `site` where None. Raises NotFoundError if it is missing or damaged."""
    workspace = WORKSPACES[definition.kind](repeater.items(definition.kind).folder(like))
    order = workspace.read_order()
    if order is None:
        raise NotFoundError(f"{definition.kind} {like}: its order is missing or damaged; name another one")
    plain = json.loads(order.model_dump_json(exclude=_lists(definition)))
    if definition.kind != "campaign":
        plain["recordings"] = []
    try:
        files = {path.name: path.read_text(encoding="utf-8") for path in sorted(workspace.robot.iterdir())}
    except (OSError, UnicodeDecodeError):
        text = f"{definition.kind} {like}: its robot file is missing or damaged; name another one"
        raise NotFoundError(text) from None
    due = definition.next_after(now, now)
    return ScheduleEntry(name, site, definition.model_dump(mode="json"), plain, files, now, due)


def _lists(definition: ScheduleDefinition) -> set[str]:
    """Fields of an order that name recordings: a campaign's `held_out` is a motion."""
    return set() if definition.kind == "campaign" else {"recordings", "held_out", "simulated", "model"}
