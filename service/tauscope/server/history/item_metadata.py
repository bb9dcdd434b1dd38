"""What the folder of an item shows, for the index: also of a damaged one."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tauscope.server.control.campaign import CampaignWorkspace
from tauscope.server.control.run import RunWorkspace
from tauscope.server.queue.diagnosis import DiagnosisWorkspace
from tauscope.server.queue.excitation import ExcitationWorkspace
from tauscope.server.queue.identification import IdentificationWorkspace
from tauscope.server.queue.record import JobState
from tauscope.server.queue.workspace import Workspace
from tauscope.server.store.database.index import FileMetadata, ItemMetadata, RecordingRole
from tauscope.server.store.files import hash_file, identifier_time

DAMAGED = "damaged"
_ROLES = ("recordings", "held_out", "simulated")
_LIVING = {"state.json", "events.jsonl", "progress", "cancel", "run.json", "stop", "control.log"}
"""Files that may still change when an item has ended, or that say nothing of its result."""


def read_metadata(kind: str, folder: Path) -> ItemMetadata:
    """What an item's folder shows."""
    facts = _READERS[kind](folder)
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
        try:
            status = os.stat(folder / name)
        except OSError:
            continue
        return f"{status.st_mtime_ns}-{status.st_size}"
    return "none"


def find_changed_file(folder: Path, artefacts: tuple[FileMetadata, ...], *, deep: bool) -> str | None:
    """The first file of an item that is not what it was when the item ended.

    Returns
    -------
    str or None
        its path below the folder; None where all are as they were
    """
    for file in artefacts:
        path = folder / file.path
        if path.is_symlink() or not path.is_file() or path.stat().st_size != file.size:
            return file.path
        if deep and hash_file(path) != file.sha256:
            return file.path
    return None


def _artefacts(folder: Path) -> Iterator[FileMetadata]:
    """Every regular file of an item that stays as it is; links are not followed."""
    for root, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = Path(root) / name
            if name in _LIVING or name.startswith(".") or path.is_symlink() or not path.is_file():
                continue
            yield FileMetadata(path.relative_to(folder).as_posix(), path.stat().st_size, hash_file(path))


def _job(kind: str, workspace: Workspace, order: Any, read_result: Callable[[], bytes | None] | None) -> ItemMetadata:
    """What every job in the queue shows."""
    folder = workspace.folder
    mark, record = stamp(kind, folder), workspace.read_record()
    if record is None or order is None:
        return _damaged(kind, folder, mark, "order.json" if order is None else "state.json")
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
    if record.state is not JobState.SUCCEEDED or read_result is None:
        return facts
    content = read_result()
    if content is None:
        return _damaged(kind, folder, mark, "result.json")
    return replace(facts, figures=_figures(kind, json.loads(content)))


def _roles(order: Any) -> Iterator[RecordingRole]:
    """The recordings of an order; motions have none."""
    for role in _ROLES:
        listed = getattr(order, role, None)
        for entry in listed if isinstance(listed, tuple) else ():
            yield RecordingRole(role, entry.name, entry.origin, entry.sha256)


def _figures(kind: str, document: Mapping[str, Any]) -> dict[str, str | float | None]:
    """What a search shows of a result; what a result of another version lacks stays open."""
    if kind == "diagnosis":
        verdict = document.get("verdict")
        return {"verdict": verdict if isinstance(verdict, str) else None}
    if kind != "identification":
        return {}
    fit = document.get("fit")
    errors = {}
    for column, part in (("relative_error", "train"), ("held_out_error", "held_out")):
        entry = fit.get(part) if isinstance(fit, dict) else None
        value = entry.get("relative_error") if isinstance(entry, dict) else None
        errors[column] = float(value) if isinstance(value, int | float) else None
    return errors


def _damaged(kind: str, folder: Path, mark: str, file: str) -> ItemMetadata:
    """An item that has lost a file without which nothing can be said of it."""
    detail = f"{folder.name}: {file} is missing or damaged; restore it from a backup, or remove it"
    created = identifier_time(folder.name)
    return ItemMetadata(kind, folder.name, DAMAGED, True, mark, created, problem=(DAMAGED, detail))


def _excitation(folder: Path) -> ItemMetadata:
    workspace = ExcitationWorkspace(folder)
    return _job("excitation", workspace, workspace.read_order(), None)


def _identification(folder: Path) -> ItemMetadata:
    workspace = IdentificationWorkspace(folder)
    return _job("identification", workspace, workspace.read_order(), workspace.read_result)


def _diagnosis(folder: Path) -> ItemMetadata:
    workspace = DiagnosisWorkspace(folder)
    return _job("diagnosis", workspace, workspace.read_order(), workspace.read_result)


def _campaign(folder: Path) -> ItemMetadata:
    workspace = CampaignWorkspace(folder)
    return _job("campaign", workspace, workspace.read_order(), None)


def _run(folder: Path) -> ItemMetadata:
    """A run has a record of its own."""
    workspace, mark = RunWorkspace(folder), stamp("run", folder)
    request, record = workspace.read_order(), workspace.read_run()
    if request is None or record is None:
        return _damaged("run", folder, mark, "request.json" if request is None else "run.json")
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


_READERS: Mapping[str, Callable[[Path], ItemMetadata]] = {
    "excitation": _excitation,
    "run": _run,
    "identification": _identification,
    "diagnosis": _diagnosis,
    "campaign": _campaign,
}
