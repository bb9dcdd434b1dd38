"""The search over HTTP: what is kept, where it stands, where it lies; with a database that does not answer too."""

import shutil
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS, connected
from server.http.problem_check import assert_problem
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked
from tauscope.server.http import Settings, create_app
from tauscope.server.store.database.database import FILE_NAME

ITEMS = "/api/v1/items"


@pytest.fixture
def old(tmp_path: Path) -> Settings:
    """A service that is given the data folder of an earlier one."""
    return Settings(data_folder=unpacked(SNAPSHOTS[-1], tmp_path))


def found(client: TestClient, **query: Any) -> list[dict[str, Any]]:
    answer = client.get(ITEMS, params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()["items"]


def test_what_an_earlier_version_left_is_found_and_every_link_leads_there(old: Settings) -> None:
    with connected(create_app(old, InlineExecutor())) as client:
        items = found(client)
        for item in items:
            assert item["is_here"] is True
            state = client.get(item["link"]).json()
            assert (state["id"], state["state"]) == (item["id"], item["state"])
        assert {item["kind"] for item in items} == {"excitation", "run", "identification", "diagnosis", "campaign"}
        (damaged,) = found(client, state="damaged")
        assert damaged["problem"].startswith(f"{damaged['id']}: state.json is missing or damaged")
        (robot,) = client.get("/api/v1/robots").json()["robots"]
        assert robot["name"] == "snapshot-arm"
        assert len(found(client, robot="snapshot-arm")) == len(items) - 1  # nobody knows whose the damaged one is
        digest = client.get(f"{RECORDINGS}/wednesday.csv").json()["sha256"]
        assert [item["kind"] for item in found(client, recording_sha256=digest)] == ["identification"]
    assert (old.data_folder / FILE_NAME).is_file()


def test_pages_follow_each_other(old: Settings) -> None:
    with connected(create_app(old, InlineExecutor())) as client:
        first = client.get(ITEMS, params={"limit": 3}).json()
        rest = client.get(ITEMS, params={"before": first["before"], "limit": 1000}).json()
        assert rest["before"] is None
        assert [*first["items"], *rest["items"]] == found(client)


def test_what_is_handed_in_is_found_at_once_and_what_is_removed_is_not(client: TestClient, paper_robot: bytes) -> None:
    files = [("robot", ("arm.yaml", paper_robot)), ("recordings", ("a.csv", b"t,q1\n0,0\n"))]
    job = client.post(IDENTIFICATIONS, files=files).json()
    (item,) = found(client, kind="identification")
    assert (item["id"], item["state"], item["link"]) == (job["id"], "failed", f"{IDENTIFICATIONS}/{job['id']}")
    assert item["problem"].startswith("a.csv")
    assert client.delete(item["link"]).status_code == 204
    assert found(client) == []


@pytest.mark.parametrize(
    "query", [{"kind": "robot"}, {"limit": 0}, {"before": "2026-11-03T10:00:00"}, {"recording_sha256": "xyz"}]
)
def test_a_query_that_means_nothing(query: dict[str, Any], client: TestClient) -> None:
    assert_problem(client.get(ITEMS, params=query), "invalid-request", 422)


def test_a_locked_database_delays_the_search_and_nothing_else(
    settings: Settings, monkeypatch: pytest.MonkeyPatch, paper_robot: bytes
) -> None:
    monkeypatch.setattr("tauscope.server.store.database.database.TIMEOUT_S", 0.02)
    with connected(create_app(settings, InlineExecutor())) as client:
        other = sqlite3.connect(settings.data_folder / FILE_NAME, isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        files = [("robot", ("arm.yaml", paper_robot)), ("recordings", ("a.csv", b"t,q1\n0,0\n"))]
        job = client.post(IDENTIFICATIONS, files=files)
        assert job.status_code == 202
        assert client.get(job.json()["links"]["self"]).json()["state"] == "failed"
        problem = assert_problem(client.get(ITEMS), "store", 503)
        assert "another program writes to it" in problem["detail"]
        other.close()
        assert len(found(client)) == 1


def test_a_database_that_is_lost_is_made_anew(old: Settings) -> None:
    seen = []
    for _ in range(2):
        with connected(create_app(old, InlineExecutor())) as client:
            seen.append(found(client))
        for path in old.data_folder.glob(f"{FILE_NAME}*"):
            path.unlink()
    assert seen[0] == seen[1]


def test_a_folder_that_was_moved_keeps_its_name(old: Settings, tmp_path: Path) -> None:
    with connected(create_app(old, InlineExecutor())) as client:
        before = found(client)
    shutil.move(old.data_folder, tmp_path / "moved")
    with connected(create_app(Settings(data_folder=tmp_path / "moved"), InlineExecutor())) as client:
        assert found(client) == before
