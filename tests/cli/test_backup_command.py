"""``tauscope backup`` and ``restore`` on the terminal."""

from collections.abc import Callable
from pathlib import Path

from cli.conftest import Ended
from server.conftest import connected
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked
from tauscope.server.http import Settings, create_app

Run = Callable[..., Ended]


def test_a_backup_of_a_running_service_is_a_service_again(run: Run, tmp_path: Path) -> None:
    data, file, new = unpacked(SNAPSHOTS[-1], tmp_path), tmp_path / "monday.tar.gz", tmp_path / "new"
    assert "there is no such database" in run("backup", file, "--data", data).err
    with connected(create_app(Settings(data_folder=data), InlineExecutor())) as client:
        ended = run("backup", file, "--data", data)
        assert (ended.status, ended.err) == (0, "")
        before = [client.get(f"/api/v1/{path}").json() for path in ("items", "models", "recordings")]
    assert run("backup", file, "--data", data).status == 1  # nothing is replaced
    assert run("restore", file, "--data", data).status == 1
    ended = run("restore", file, "--data", new)
    assert (ended.status, ended.err) == (0, "")
    with connected(create_app(Settings(data_folder=new), InlineExecutor())) as client:
        after = [client.get(f"/api/v1/{path}").json() for path in ("items", "models", "recordings")]
    for entry in after[2]["recordings"] + before[2]["recordings"]:
        del entry["sha256"], entry["modified"]  # the memory of hashes is not part of it, and seconds are whole
    assert after == before
