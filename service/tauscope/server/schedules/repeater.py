"""Starting what a schedule repeats: a campaign, or an analysis of the newest recordings."""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TypeVar

from tauscope.errors import NotFoundError, TauscopeError
from tauscope.server.control.campaign import CampaignOrder, CampaignWorkspace
from tauscope.server.control.campaign_manager import CampaignManager
from tauscope.server.control.campaign_runner import CampaignDependencies
from tauscope.server.control.leases import FREE, Permit
from tauscope.server.queue.diagnosis import DiagnosisOrder, DiagnosisWorkspace
from tauscope.server.queue.identification import IdentificationOrder, IdentificationWorkspace
from tauscope.server.queue.stored import StoredModel
from tauscope.server.queue.task_job import OrderedRecording, ordered_on_server
from tauscope.server.queue.workspace import Workspace
from tauscope.server.schedules.definition import RecordingChoice, ScheduleDefinition
from tauscope.server.schedules.repository import ScheduleEntry
from tauscope.server.store.items import ItemStore
from tauscope.server.store.recordings import RecordingStore

Order = TypeVar("Order", bound=StoredModel)


class NothingToDoError(TauscopeError):
    """There is no new recording: what would be found is known already."""


@dataclass(frozen=True, eq=False)
class Repeater:
    """Starts what schedules repeat."""

    dependencies: CampaignDependencies
    campaigns: CampaignManager
    permit_for: Callable[[str], Permit] = field(default_factory=lambda: lambda _device: FREE)

    def start(self, entry: ScheduleEntry, since: datetime | None) -> tuple[str, str]:
        """Start it; returns at once.

        Returns
        -------
        (str, str)
            kind and identifier of what was started

        Raises
        ------
        NothingToDoError
            if there is no new recording
        TauscopeError
            if it cannot be started
        """
        definition = ScheduleDefinition.model_validate(dict(entry.definition), strict=False)
        if definition.kind == "campaign":
            return "campaign", self._campaign(entry)
        assert definition.recordings is not None  # noqa: S101 - checked by the definition
        train, held_out = newest_recordings(self.dependencies.recordings, definition.recordings, since)
        if definition.kind == "identification":
            return "identification", self._identification(entry, train, held_out)
        return "diagnosis", self._diagnosis(entry, train, held_out)

    def goes_on(self, kind: str, identifier: str) -> bool:
        """Whether something that was started has not ended; what was removed has."""
        try:
            return not Workspace(self.items(kind).folder(identifier)).has_ended()
        except NotFoundError:
            return False

    def items(self, kind: str) -> ItemStore:
        """The folders of what is repeated."""
        if kind == "campaign":
            return self.campaigns.items
        return (self.dependencies.identifications if kind == "identification" else self.dependencies.diagnoses).items

    def _campaign(self, entry: ScheduleEntry) -> str:
        """A campaign like the one that the schedule was made from."""
        items = self.campaigns.items
        staged = items.stage()
        try:
            workspace = CampaignWorkspace(staged)
            workspace.prepare()
            write_robot(workspace.robot, entry)
            order = _order(entry, CampaignOrder)
            workspace.write_order(order)
            return self.campaigns.submit(staged, self.permit_for(order.backend.device(order.robot_name)))
        finally:
            items.discard(staged)

    def _identification(
        self, entry: ScheduleEntry, train: tuple[OrderedRecording, ...], held_out: tuple[OrderedRecording, ...]
    ) -> str:
        """An identification from other recordings."""
        kind = self.dependencies.identifications
        staged = kind.items.stage()
        try:
            workspace = IdentificationWorkspace(staged)
            workspace.prepare()
            write_robot(workspace.robot, entry)
            changes = {"recordings": train, "held_out": held_out}
            workspace.write_order(_order(entry, IdentificationOrder).model_copy(update=changes))
            return self.dependencies.jobs.submit(kind, staged)
        finally:
            kind.items.discard(staged)

    def _diagnosis(
        self, entry: ScheduleEntry, train: tuple[OrderedRecording, ...], held_out: tuple[OrderedRecording, ...]
    ) -> str:
        """A diagnosis of other recordings."""
        kind = self.dependencies.diagnoses
        staged = kind.items.stage()
        try:
            workspace = DiagnosisWorkspace(staged)
            workspace.prepare()
            write_robot(workspace.robot, entry)
            changes = {"recordings": train, "held_out": held_out}
            workspace.write_order(_order(entry, DiagnosisOrder).model_copy(update=changes))
            return self.dependencies.jobs.submit(kind, staged)
        finally:
            kind.items.discard(staged)


def newest_recordings(
    store: RecordingStore, choice: RecordingChoice, since: datetime | None
) -> tuple[tuple[OrderedRecording, ...], tuple[OrderedRecording, ...]]:
    """The recordings that an analysis takes: those to judge by are the newest, the others come before them.

    Raises
    ------
    NothingToDoError
        if there are too few, or none is new
    """
    found = [entry for entry in store.entries() if fnmatchcase(entry.name, choice.pattern)]
    wanted = sorted(found, key=lambda entry: (entry.modified, entry.name))[-(choice.train + choice.held_out) :]
    if len(wanted) < choice.train + choice.held_out:
        needed = choice.train + choice.held_out
        raise NothingToDoError(f"{len(wanted)} recordings match {choice.pattern}, {needed} are needed; record more")
    if since is not None and wanted[-1].modified <= since:
        raise NothingToDoError(f"no recording that matches {choice.pattern} is newer than the last time; record more")
    names = [entry.name for entry in wanted]
    return ordered_on_server(store, names[: choice.train]), ordered_on_server(store, names[choice.train :])


def write_robot(folder: Path, entry: ScheduleEntry) -> None:
    """Write a robot's files."""
    for name, text in entry.files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _order(entry: ScheduleEntry, kind: type[Order]) -> Order:
    """The order that is repeated."""
    return kind.model_validate(dict(entry.order), strict=False)
