"""The index against the folders: an old data folder, damage, removal by hand, a database that was lost or locked."""

import json
import shutil
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from snapshots import SNAPSHOTS, unpacked
from tauscope.errors import StoreError
from tauscope.server.history.indexer import ChangedItem, Indexer, open_index
from tauscope.server.queue.housekeeping import Housekeeping
from tauscope.server.queue.job_folder import JobRecord, JobState, Workspace
from tauscope.server.store.data_folder import RECORDINGS, item_stores
from tauscope.server.store.database.database import Database
from tauscope.server.store.database.index import Index, ItemEntry, ItemQuery
from tauscope.server.store.recordings import RecordingStore

WAYS_TO_END = {
    ("identification", "succeeded"): 2,
    ("identification", "failed"): 1,
    ("identification", "damaged"): 1,
    ("identification", "interrupted"): 1,
    ("diagnosis", "succeeded"): 1,
    ("excitation", "succeeded"): 3,
    ("run", "finished"): 3,
    ("campaign", "succeeded"): 1,
}
"""What every snapshot holds, by kind and state."""


@pytest.fixture(params=SNAPSHOTS, ids=lambda path: path.name.removesuffix(".tar.xz"))
def data(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return unpacked(request.param, tmp_path)


@pytest.fixture
def keeper(data: Path, database: Database) -> Indexer:
    return opened(data, database)


def opened(data: Path, database: Database) -> Indexer:
    keeper = open_index(Index(database, "here"), item_stores(data), RecordingStore(data / RECORDINGS), "data")
    keeper.sync(thorough=True)
    return keeper


def all_of(keeper: Indexer) -> list[ItemEntry]:
    return keeper.index.search(ItemQuery(limit=1000))


def one(keeper: Indexer, kind: str, state: str) -> ItemEntry:
    return keeper.index.search(ItemQuery(kind=kind, state=state))[0]


def folder(data: Path, entry: ItemEntry) -> Path:
    return item_stores(data)[entry.kind].folder(entry.identifier)


def bytes_below(data: Path) -> dict[str, bytes]:
    return {str(path.relative_to(data)): path.read_bytes() for path in sorted(data.rglob("*")) if path.is_file()}


def test_an_old_data_folder_is_indexed_and_left_as_it_is(data: Path, database: Database) -> None:
    before = bytes_below(data)
    keeper = opened(data, database)
    counts: dict[tuple[str, str], int] = {}
    for entry in all_of(keeper):
        counts[entry.kind, entry.state] = counts.get((entry.kind, entry.state), 0) + 1
    assert counts == WAYS_TO_END
    assert bytes_below(data) == before
    found = next(
        each for each in keeper.index.search(ItemQuery(kind="identification")) if each.figures["held_out_error"]
    )
    document = json.loads((folder(data, found) / "result.json").read_bytes())
    assert found.figures["held_out_error"] == document["fit"]["held_out"]["relative_error"]
    assert one(keeper, "diagnosis", "succeeded").figures["verdict"] in {"consistent", "explained", "unexplained"}
    assert [robot.name for robot in keeper.index.robots()] == ["snapshot-arm"]
    assert keeper.check() == [ChangedItem("identification", one(keeper, "identification", "damaged").identifier, "")]


def test_a_lost_index_is_made_anew(data: Path, tmp_path: Path) -> None:
    found = []
    for name in ("first.db", "second.db"):
        database = Database(tmp_path / name)
        keeper = opened(data, database)
        found.append([(entry, keeper.index.artefacts(entry.kind, entry.identifier)) for entry in all_of(keeper)])
        database.close()
    assert found[0] == found[1]
    assert len(found[0]) == sum(WAYS_TO_END.values())


def test_what_was_removed_by_hand_is_forgotten(keeper: Indexer, data: Path) -> None:
    gone = one(keeper, "diagnosis", "succeeded")
    shutil.rmtree(folder(data, gone))
    (data / RECORDINGS / "monday.csv").unlink()
    keeper.sync()
    assert gone not in all_of(keeper)
    assert len(all_of(keeper)) == sum(WAYS_TO_END.values()) - 1


def test_a_job_is_followed_to_its_end(keeper: Indexer, data: Path) -> None:
    store = item_stores(data)["identification"]
    staged = store.stage()
    shutil.copy(folder(data, one(keeper, "identification", "succeeded")) / "order.json", staged)
    record = JobRecord(state=JobState.QUEUED, created=store.clock())
    Workspace(staged).write_record(record)
    identifier = store.publish(staged)
    states = []
    for state in (None, JobState.RUNNING, JobState.CANCELLED):
        if state is not None:
            record = record.moved(state, store.clock())
            Workspace(store.folder(identifier)).write_record(record)
        keeper.sync()
        states += [entry.state for entry in all_of(keeper) if entry.identifier == identifier]
    assert states == ["queued", "running", "cancelled"]
    assert [file.path for file in keeper.index.artefacts("identification", identifier)] == ["order.json"]


@pytest.mark.parametrize("damage", ["one byte", "shorter", "gone", "a link"])
def test_a_changed_file_is_found_and_shown_until_it_is_put_right(damage: str, keeper: Indexer, data: Path) -> None:
    entry = keeper.index.search(ItemQuery(kind="diagnosis"))[0]
    path = folder(data, entry) / "result.json"
    content = path.read_bytes()
    if damage == "one byte":
        path.write_bytes(content.replace(b"verdict", b"verdicT", 1))
    elif damage == "shorter":
        path.write_bytes(content[:-1])
    else:
        path.unlink()
    if damage == "a link":
        (data / "elsewhere.json").write_bytes(content)
        path.symlink_to(data / "elsewhere.json")
    changed = ChangedItem("diagnosis", entry.identifier, "result.json")
    assert changed in keeper.check()
    (shown,) = keeper.index.search(ItemQuery(kind="diagnosis"))
    assert (shown.state, shown.problem_code) == ("damaged", "damaged")
    assert "result.json is not what it was" in (shown.problem_detail or "")
    keeper.sync(thorough=True)
    assert keeper.index.search(ItemQuery(kind="diagnosis"))[0].state == "damaged"
    path.unlink(missing_ok=True)
    path.write_bytes(content)
    assert changed not in keeper.check()
    assert keeper.index.search(ItemQuery(kind="diagnosis"))[0].state == "succeeded"


@pytest.mark.parametrize("file", ["state.json", "order.json", "result.json"])
@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"[]", b"{}", b"[" * 100_000], ids=range(5))
def test_any_damage_is_shown_never_raised(file: str, content: bytes, data: Path, tmp_path: Path) -> None:
    for kind, store in item_stores(data).items():
        for identifier in store.identifiers():
            name = {"run": {"order.json": "request.json"}.get(file, "control/run.json")}.get(kind, file)
            if (store.folder(identifier) / name).exists():
                (store.folder(identifier) / name).write_bytes(content)
    database = Database(tmp_path / "x.db")
    keeper = opened(data, database)
    found = all_of(keeper)
    database.close()
    assert len(found) == sum(WAYS_TO_END.values())
    damaged = {entry.kind for entry in found if entry.state == "damaged"}
    assert damaged >= (
        {"identification", "diagnosis"} if file == "result.json" else {"identification", "run", "campaign"}
    )


@pytest.fixture
def locked(data: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Indexer, sqlite3.Connection]]:
    monkeypatch.setattr("tauscope.server.store.database.database.TIMEOUT_S", 0.02)
    database = Database(data / "tauscope.db")
    other = sqlite3.connect(data / "tauscope.db", isolation_level=None)
    yield opened(data, database), other
    other.close()
    database.close()


def test_what_happens_while_the_database_is_locked_is_made_up_for(
    locked: tuple[Indexer, sqlite3.Connection], data: Path, caplog: pytest.LogCaptureFixture
) -> None:
    keeper, other = locked
    gone = one(keeper, "diagnosis", "succeeded")
    other.execute("BEGIN IMMEDIATE")
    shutil.rmtree(folder(data, gone))
    housekeeping = Housekeeping([keeper.sync])
    with pytest.raises(StoreError, match="another program writes"):
        keeper.sync()
    for _ in range(3):
        housekeeping.round()
    assert caplog.text.count("it is tried again") == 1
    other.execute("ROLLBACK")
    housekeeping.round()
    assert "works again" in caplog.text
    assert gone not in all_of(keeper)
