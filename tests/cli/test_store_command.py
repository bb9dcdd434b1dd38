"""``tauscope store check``: what is said of an old data folder, and of one whose files were changed."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cli.conftest import Ended
from server.conftest import connected
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked
from tauscope.server.http import Settings, create_app
from tauscope.server.store.data_folder import RECORDINGS, FolderLock, item_stores
from tauscope.server.store.recordings import RecordingStore

Run = Callable[..., Ended]


@pytest.fixture
def data(tmp_path: Path) -> Path:
    folder = unpacked(SNAPSHOTS[-1], tmp_path)
    for damaged in (folder / "identifications").glob("*/state.json"):
        if damaged.stat().st_size < 30:
            damaged.unlink()
            damaged.parent.rename(folder / "removed")
    return folder


def test_a_sound_folder_and_then_a_changed_file(run: Run, data: Path) -> None:
    ended = run("store", "check", "--data", data)
    assert (ended.status, ended.err) == (0, "")
    assert "12 items and 7 recordings, all as they were" in ended.out
    (result,) = (data / "diagnoses").glob("*/result.json")
    result.write_bytes(result.read_bytes().replace(b"noise_std", b"noise_stD"))
    quick = run("store", "check", "--data", data, "--quick")
    assert quick.status == 0
    ended = run("store", "check", "--data", data)
    assert ended.status == 1
    assert "of 12 items and 7 recordings, 1 damaged" in ended.err
    assert result.parent.name in ended.out
    assert "result.json" in ended.out


def kinds(data: Path) -> dict[str, int]:
    return {name: len(store.identifiers()) for name, store in item_stores(data).items()}


def test_what_is_old_goes_and_what_is_relied_upon_stays(run: Run, data: Path) -> None:
    with connected(create_app(Settings(data_folder=data), InlineExecutor())) as client:
        (active,) = [model for model in client.get("/api/v1/models").json()["models"] if model["state"] == "active"]
    before = kinds(data)
    young = run("store", "prune", "--older-than", "100000", "--data", data)
    assert (young.status, kinds(data)) == (0, before)
    planned = run("store", "prune", "--older-than", "0", "--recordings", "--dry-run", "--data", data)
    assert (planned.status, kinds(data)) == (0, before)
    assert "16 items would go" in planned.out
    runs = run("store", "prune", "--older-than", "0", "--kind", "run", "--data", data)
    assert "3 items removed" in runs.out
    assert kinds(data) == {**before, "run": 0}
    ended = run("store", "prune", "--older-than", "0", "--recordings", "--data", data)
    assert (ended.status, ended.err) == (0, "")
    assert kinds(data) == {**dict.fromkeys(before, 0), "identification": 1}
    assert item_stores(data)["identification"].identifiers() == [active["id"]]
    names = {entry.name for entry in RecordingStore(data / RECORDINGS).entries()}
    assert names == {"monday.csv", "tuesday.csv"}  # of which it was made, and by which it was judged


def test_a_folder_that_a_service_works_with_is_left_to_it(run: Run, data: Path) -> None:
    lock = FolderLock(data)
    ended = run("store", "check", "--data", data)
    lock.release()
    assert ended.status == 1
    assert "another tauscope service works with this folder" in ended.err
