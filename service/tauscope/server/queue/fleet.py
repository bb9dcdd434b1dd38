"""The same analysis for many robots: on any executor, one row a robot, a failure is that robot's alone."""

import csv
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from tauscope.errors import RecordingError, TauscopeError, one_line
from tauscope.files import write_atomically
from tauscope.remote_files import find_path
from tauscope.robot.messages import shown
from tauscope.server.queue.cluster_executor import ClusterUnavailableError
from tauscope.server.store.files import FILE_NAME_RULE, is_file_name
from tauscope.tasks import diagnose, identify
from tauscope.tasks.task import Files

COLUMNS = ("name", "robot", "recordings", "held_out")
SEPARATOR = ";"
IDENTIFICATION_COLUMNS = ("relative_error", "held_out_error", "condition_number", "constrained")
DIAGNOSIS_COLUMNS = ("verdict", "findings")
LOST = "the process that worked on it ended unexpectedly, perhaps for want of memory; send less data"
AWAY = "the Dask cluster was away for too long; see to its scheduler, and give this robot once more"


@dataclass(frozen=True)
class FleetEntry:
    row: int
    name: str
    robot: Path
    recordings: tuple[Path, ...]
    held_out: tuple[Path, ...]


@dataclass(frozen=True)
class FleetResult:
    entry: FleetEntry
    figures: dict[str, str]
    error: str | None
    seconds: float = 0.0


FleetWork = Callable[[FleetEntry, Path], FleetResult]
"""Analyses a robot, writes its result into a folder, and returns a row; called by a worker."""


def read_manifest(path: Path) -> Iterator[FleetEntry]:
    """Robots of a CSV with the columns `COLUMNS`; paths are relative to it. Raises RecordingError naming the line."""
    names: dict[str, int] = {}
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            if tuple(reader.fieldnames or ()) != COLUMNS:
                found = ",".join(reader.fieldnames or ()) or "nothing"
                raise RecordingError(f"{path}: line 1: begins with {found}; write {','.join(COLUMNS)}")
            for row in reader:
                yield _entry(path, reader.line_num, row, names)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: cannot be read ({error}); write a CSV file in UTF-8") from None


def analyse_fleet(
    entries: Iterator[FleetEntry], work: FleetWork, folder: Path, executor: Executor, width: int
) -> Iterator[FleetResult]:
    """Results as they come, 2 `width` in the executor; after a lost worker, what it held is done one by one."""
    pending: dict[Future[FleetResult], FleetEntry] = {}
    suspects: list[FleetEntry] = []
    is_exhausted = False
    while pending or not is_exhausted:
        while len(pending) < 2 * width and not is_exhausted:
            entry = next(entries, None)
            if entry is None:
                is_exhausted = True
            else:
                pending[_submit(executor, work, entry, folder)] = entry
        done, _ = wait(pending, return_when=FIRST_COMPLETED)
        for future in done:
            entry = pending.pop(future)
            if isinstance(future.exception(), BrokenExecutor):
                suspects.append(entry)
            else:
                yield _result(future, entry)
    for entry in suspects:
        yield _result(_submit(executor, work, entry, folder), entry)


def identify_robot(entry: FleetEntry, folder: Path) -> FleetResult:
    return _perform(identify, entry, folder)


def diagnose_robot(entry: FleetEntry, folder: Path) -> FleetResult:
    return _perform(diagnose, entry, folder)


def _perform(task: ModuleType, entry: FleetEntry, folder: Path) -> FleetResult:
    """Perform a task and write its result; a failure that Tauscope foresees is a row of the table."""
    begin, figures, error_text = time.monotonic(), dict[str, str](), None
    try:
        request = task.Request(
            robot=str(entry.robot),
            recordings=tuple(map(str, entry.recordings)),
            held_out=tuple(map(str, entry.held_out)),
        )
        result = task.perform(request, Files(), lambda *_: None)
        write_atomically(folder / f"{entry.name}.json", result.outputs["result.json"])
        figures = _figures(result.document)
    except TauscopeError as error:
        error_text = f"{error.code}: {error}"
    except OSError as error:
        error_text = f"{error.filename or entry.name}: {error.strerror or error}"
    return FleetResult(entry, figures, error_text, time.monotonic() - begin)


def _figures(found: Any) -> dict[str, str]:
    if hasattr(found, "verdict"):
        findings = (f"{each.effect}@{each.joint}" if each.joint else each.effect for each in found.findings)
        return {"verdict": found.verdict, "findings": "; ".join(findings)}
    judged = found.fit.held_out
    return {
        "relative_error": f"{found.fit.train.relative_error:.6g}",
        "held_out_error": "" if judged is None else f"{judged.relative_error:.6g}",
        "condition_number": f"{found.condition_number:.6g}",
        "constrained": str(found.constrained).lower(),
    }


def _submit(executor: Executor, work: FleetWork, entry: FleetEntry, folder: Path) -> "Future[FleetResult]":
    """A robot in the executor; where that takes nothing, a future that says so."""
    try:
        return executor.submit(work, entry, folder)
    except BrokenExecutor as error:
        refused: Future[FleetResult] = Future()
        refused.set_exception(error)
        return refused


def _result(future: "Future[FleetResult]", entry: FleetEntry) -> FleetResult:
    try:
        return future.result()
    except ClusterUnavailableError:
        return FleetResult(entry, {}, AWAY)
    except BrokenExecutor:
        return FleetResult(entry, {}, LOST)
    except Exception as error:
        return FleetResult(entry, {}, f"a fault of Tauscope's own ({type(error).__name__}: {one_line(str(error))})")


def _entry(path: Path, line: int, row: dict[str, str], names: dict[str, int]) -> FleetEntry:
    place = f"{path}: line {line}"
    if None in row or None in row.values():
        raise RecordingError(f"{place}: has not {len(COLUMNS)} columns; separate recordings by {SEPARATOR}")
    name = row["name"].strip()
    if not is_file_name(name):
        raise RecordingError(f"{place}: name {shown(name)}: {FILE_NAME_RULE}")
    if name in names:
        raise RecordingError(f"{place}: name {name} is that of line {names[name]} too; give each robot its own")
    names[name] = line
    recordings, held_out = (
        tuple(find_path(word, path.parent) for word in map(str.strip, row[column].split(SEPARATOR)) if word)
        for column in ("recordings", "held_out")
    )
    if not recordings or not row["robot"].strip():
        raise RecordingError(f"{place}: names no {'recording' if row['robot'].strip() else 'robot file'}; name one")
    return FleetEntry(line, name, find_path(row["robot"].strip(), path.parent), recordings, held_out)
