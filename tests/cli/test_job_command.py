"""``tauscope job``: done by this process where no service is there, by the service where one is."""

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from cli.conftest import Ended
from figures import leave_figures_undrawn
from server.conftest import connected
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked
from tauscope.server.http import Settings, create_app

Run = Callable[..., Ended]


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """An old data folder with a schedule that identifies the arm."""
    folder = unpacked(SNAPSHOTS[-1], tmp_path)
    with connected(create_app(Settings(data_folder=folder), InlineExecutor())) as client:
        query = {"kind": "identification", "state": "succeeded"}
        like = client.get("/api/v1/items", params=query).json()["items"][-1]["id"]
        definition = {"kind": "identification", "cron": "0 2 * * *", "recordings": {"pattern": "*day.csv"}}
        for name, pattern in (("nightly", "*day.csv"), ("broken", "[br][ru][on]*.csv"), ("never", "x*")):
            definition["recordings"] = {"pattern": pattern}
            body = {"like": like, "definition": definition}
            assert client.put(f"/api/v1/schedules/{name}", json=body).status_code == 200
    return folder


@pytest.fixture
def done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Work is done in this process: what is tested here are not the workers."""
    for name in ("open_readers", "open_executor"):
        monkeypatch.setattr(f"tauscope.server.http.services.{name}", lambda *_, **__: InlineExecutor())
    monkeypatch.setattr("tauscope.cli.job_command.POLL_S", 0.02)
    leave_figures_undrawn(monkeypatch)


@pytest.mark.usefixtures("done_here")
def test_without_a_service_this_process_does_it(run: Run, data: Path) -> None:
    ended = run("job", "run", "nightly", "--data", data)
    assert (ended.status, ended.err) == (0, "")
    assert "schedule nightly: identification" in ended.out
    assert ended.out.strip().endswith("succeeded")
    ended = run("job", "run", "nightly", "--data", data)
    assert ended.status == 1
    assert "schedule nightly: skipped: no recording that matches *day.csv is newer than the last time" in ended.err
    ended = run("job", "run", "never", "--data", data)
    assert (ended.status, len(ended.err.splitlines())) == (1, 1)
    ended = run("job", "list", "--data", data)
    assert ended.status == 0
    assert "skipped: no recording" in ended.out
    assert "did you mean 'nightly'" in run("job", "run", "nigthly", "--data", data).err


@pytest.mark.usefixtures("done_here")
def test_an_end_that_is_no_success_is_none(run: Run, data: Path) -> None:
    (data / "recordings" / "run-newest.csv").write_text("t,q1,tau1\n0,0,oops\n", encoding="utf-8")
    ended = run("job", "run", "broken", "--data", data)
    assert ended.status == 1
    assert "ended failed" in ended.err


@pytest.mark.usefixtures("done_here")
def test_a_service_that_is_there_does_it(run: Run, data: Path) -> None:
    with connected(create_app(Settings(data_folder=data), InlineExecutor())):
        ended: list[Ended] = []
        thread = threading.Thread(target=lambda: ended.append(run("job", "run", "nightly", "--data", data)))
        thread.start()
        thread.join(60)
    assert ended[0].status == 0, ended[0].err
    assert ended[0].out.strip().endswith("succeeded")


@pytest.mark.usefixtures("done_here")
def test_a_service_that_does_not_take_it_on(run: Run, data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauscope.cli.job_command.PATIENCE_S", 0.1)
    with connected(create_app(Settings(data_folder=data, fires_schedules=False), InlineExecutor())):
        ended = run("job", "run", "nightly", "--data", data)
    assert ended.status == 1
    assert "no service took it on" in ended.err
