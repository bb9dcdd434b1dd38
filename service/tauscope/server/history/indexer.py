"""The indexer: it reads the metadata of every item folder and keeps the database index like the folders."""

import json
import logging
import os
import threading
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from tauscope.errors import NotFoundError
from tauscope.server.control.campaign import CampaignWorkspace
from tauscope.server.control.run import RunWorkspace
from tauscope.server.queue.analyses import TASKS
from tauscope.server.queue.job_folder import JobState
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.database.index import FileMetadata, Index, ItemMetadata, RecordingRole
from tauscope.server.store.files import hash_file, identifier_time
from tauscope.server.store.recordings import RecordingStore

WORKSPACES: Mapping[str, type[Any]] = {**TASKS, "campaign": CampaignWorkspace}
"""The folder of each kind of item that has a job's record; a run has a record of its own."""
DAMAGED = "damaged"
_ROLES = ("recordings", "held_out", "simulated", "refine")
_LIVING = {"state.json", "events.jsonl", "progress", "cancel", "run.json", "stop", "control.log"}
"""Files that may still change when an item has ended, or that say nothing of its result."""


def read_metadata(kind: str, folder: Path) -> ItemMetadata:
    facts = _read_run(folder) if kind == "run" else _read_job(kind, folder)
    if not facts.is_final:
        return facts
    try:
        return replace(facts, artefacts=tuple(_artefacts(folder)))
    except OSError as error:
        return replace(facts, state=DAMAGED, problem=(DAMAGED, f"{folder.name}: cannot be read ({error.strerror})"))


def stamp(kind: str, folder: Path) -> str:
    """What changes when the state of an item does."""
    names = ("control/run.json", "run.json") if kind == "run" else ("state.json",)
    for name in names:
        with suppress(OSError):
            status = os.stat(folder / name)
            return f"{status.st_mtime_ns}-{status.st_size}"
    return "none"


def find_changed_file(folder: Path, artefacts: tuple[FileMetadata, ...], *, deep: bool) -> str | None:
    """Path, below the folder, of the first file that is not what it was when the item ended; None without one."""
    for file in artefacts:
        path = folder / file.path
        if path.is_symlink() or not path.is_file() or path.stat().st_size != file.size:
            return file.path
        if deep and hash_file(path) != file.sha256:
            return file.path
    return None


def _artefacts(folder: Path) -> Iterator[FileMetadata]:
    for root, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = Path(root) / name
            if name in _LIVING or name.startswith(".") or path.is_symlink() or not path.is_file():
                continue
            yield FileMetadata(path.relative_to(folder).as_posix(), path.stat().st_size, hash_file(path))


def _read_job(kind: str, folder: Path) -> ItemMetadata:
    workspace = WORKSPACES[kind](folder)
    mark, record, order = stamp(kind, folder), workspace.read_record(), workspace.read_order()
    if record is None or order is None:
        return _describe_damage(kind, folder, mark, "order.json" if order is None else "state.json")
    facts = ItemMetadata(
        kind=kind,
        identifier=folder.name,
        state=record.state.value,
        is_final=record.state.is_end,
        stamp=mark,
        created=record.created,
        ended=record.ended,
        robot=order.robot_name,
        problem=None if record.problem is None else (record.problem.code, record.problem.detail),
        recordings=tuple(_roles(order)),
    )
    if record.state is not JobState.SUCCEEDED or kind in ("campaign", "excitation"):
        return facts
    content = workspace.read_result()
    if content is None:
        return _describe_damage(kind, folder, mark, "result.json")
    return replace(facts, figures=_figures(kind, json.loads(content)))


def _roles(order: Any) -> Iterator[RecordingRole]:
    for role in _ROLES:
        listed = getattr(order, role, None)
        for entry in listed if isinstance(listed, tuple) else ():
            yield RecordingRole(role, entry.name, entry.origin, entry.sha256)


def _figures(kind: str, document: Mapping[str, Any]) -> dict[str, str | float | None]:
    """What a search shows of a result; what a result of another version lacks stays open."""
    if kind == "diagnosis":
        words = {name: document.get(name) for name in ("verdict", "headline")}
        return {name: word if isinstance(word, str) and word else None for name, word in words.items()}
    if kind != "identification":
        return {}
    fit = document.get("fit")
    errors = {}
    for column, part in (("relative_error", "train"), ("held_out_error", "held_out")):
        entry = fit.get(part) if isinstance(fit, dict) else None
        value = entry.get("relative_error") if isinstance(entry, dict) else None
        errors[column] = float(value) if isinstance(value, int | float) else None
    return errors


def _describe_damage(kind: str, folder: Path, mark: str, file: str) -> ItemMetadata:
    detail = f"{folder.name}: {file} is missing or damaged; restore it from a backup, or remove it"
    created = identifier_time(folder.name)
    return ItemMetadata(kind, folder.name, DAMAGED, True, mark, created, problem=(DAMAGED, detail))


def _read_run(folder: Path) -> ItemMetadata:
    workspace, mark = RunWorkspace(folder), stamp("run", folder)
    request, record = workspace.read_order(), workspace.read_record()
    if request is None or record is None:
        return _describe_damage("run", folder, mark, "request.json" if request is None else "run.json")
    problem = workspace.problem()
    return ItemMetadata(
        kind="run",
        identifier=folder.name,
        state=record.state.value,
        is_final=record.state.is_end,
        stamp=mark,
        created=record.history[0].at if record.history else identifier_time(folder.name),
        ended=record.history[-1].at if record.state.is_end and record.history else None,
        robot=request.robot_name,
        problem=None if problem is None else (problem.code, problem.detail),
        figures={"backend": request.backend.name},
    )


_log = logging.getLogger("tauscope.jobs")
BATCH = 200  # items that are indexed at once
LONGEST_WAIT_S = 1.0
"""How long a search waits for what is new; while an old folder is indexed it finds what is indexed until then [s]."""


@dataclass(frozen=True)
class ChangedItem:
    kind: str
    identifier: str
    path: str


class Indexer:
    """Keeps the index like the folders, which are right; a database that is gone holds up no job."""

    def __init__(self, index: Index, items: Mapping[str, ItemStore], recordings: RecordingStore) -> None:
        self.index, self._items, self._recordings = index, items, recordings
        self._lock = threading.Lock()
        self._known: dict[str, dict[str, tuple[str, bool]]] = {}
        self._seen_recordings: object = None
        self._is_whole = False
        self._is_closing = threading.Event()

    def sync(self, *, thorough: bool = False) -> None:
        """Bring the index up to date. Raises StoreError if the database does not answer; the next call goes on."""
        with self._lock:
            thorough = thorough or not self._is_whole
            if thorough:
                self._known = {kind: self.index.stamps(kind) for kind in self._items}
            for kind, store in self._items.items():
                self._sync_kind(kind, store, thorough=thorough)
            recordings = self._recordings.entries()
            if recordings != self._seen_recordings:
                self.index.put_recordings(recordings)
                self._seen_recordings = recordings
            self._is_whole = not self._is_closing.is_set()

    def close(self) -> None:
        self._is_closing.set()

    def refresh(self) -> None:
        """As `sync`, unless another thread is at it for long. Raises StoreError if the database does not answer."""
        if self._lock.acquire(timeout=LONGEST_WAIT_S):
            self._lock.release()
            self.sync()

    def check(self, *, deep: bool = True) -> list[ChangedItem]:
        """Compare the files of every ended item, and every recording, with the hashes kept of them."""
        self.sync(thorough=True)
        found = [ChangedItem("recording", name, "") for name in self._recordings.damaged(deep=deep)]
        for kind, store in self._items.items():
            damaged = self.index.damaged(kind)
            for identifier, (_, is_final) in sorted(self._known[kind].items()):
                if is_final:
                    found += self._check_item(kind, store, identifier, damaged, deep=deep)
        return found

    def _check_item(
        self, kind: str, store: ItemStore, identifier: str, damaged: Collection[str], *, deep: bool
    ) -> list[ChangedItem]:
        """The file of an item that changed, if there is one; a damaged item that was put right is read anew."""
        try:
            folder = store.folder(identifier)
        except NotFoundError:
            return []
        path = find_changed_file(folder, self.index.artefacts(kind, identifier), deep=deep)
        if path is not None:
            hint = "restore it from a backup, or remove the item"
            self.index.mark_damaged(kind, identifier, f"{identifier}: {path} is not what it was; {hint}")
            return [ChangedItem(kind, identifier, path)]
        if identifier not in damaged:
            return []
        facts = read_metadata(kind, folder)
        if facts.state == DAMAGED or not deep:
            return [ChangedItem(kind, identifier, "")]
        self.index.put([facts])
        return []

    def _sync_kind(self, kind: str, store: ItemStore, *, thorough: bool) -> None:
        known, present = self._known[kind], store.identifiers()
        gone = known.keys() - set(present)
        if gone:
            self.index.forget(kind, gone)
            for identifier in gone:
                del known[identifier]
        found: list[ItemMetadata] = []
        for identifier in reversed(present):
            if self._is_closing.is_set():
                break
            indexed = known.get(identifier)
            if indexed is not None and indexed[1] and not thorough:
                continue
            facts = self._read_changed(kind, store, identifier, indexed)
            if facts is not None:
                found.append(facts)
            if len(found) == BATCH:
                self._put(kind, found)
                found = []
        self._put(kind, found)

    def _read_changed(
        self, kind: str, store: ItemStore, identifier: str, indexed: tuple[str, bool] | None
    ) -> ItemMetadata | None:
        try:
            identifier_time(identifier)
            folder = store.folder(identifier)
        except (NotFoundError, ValueError):
            return None
        if indexed is not None and indexed[0] == stamp(kind, folder):
            return None
        facts = read_metadata(kind, folder)
        return facts if folder.is_dir() else None

    def _put(self, kind: str, found: Sequence[ItemMetadata]) -> None:
        """Index items in one transaction: to wait for the disk once each would take hours for a large folder."""
        self.index.put(found)
        self._known[kind] |= {facts.identifier: (facts.stamp, facts.is_final) for facts in found}


def open_index(index: Index, items: Mapping[str, ItemStore], recordings: RecordingStore, label: str) -> Indexer:
    """Register the data folder; `Indexer.sync` fills its index. Raises StoreError if the database does not answer."""
    index.register(label, datetime.now(UTC))
    return Indexer(index, items, recordings)
