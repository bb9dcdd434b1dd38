"""Old items go while the service works, where the operator asked for it, and nothing that is relied upon."""

import json
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS, connected
from server.http.motions import ROBOT
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.waiting import wait_until
from snapshots import SNAPSHOTS, unpacked
from tauscope.cli.program import main
from tauscope.server.auth.audit_log import AuditLog
from tauscope.server.http import Settings, create_app

ITEMS = "/api/v1/items"


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An old data folder, with an identification that is still to be done."""
    folder = unpacked(SNAPSHOTS[-1], tmp_path)
    with connected(create_app(Settings(data_folder=folder), ManualExecutor())) as client:
        answer = client.post(IDENTIFICATIONS, json={"robot": ROBOT, "recordings": ["wednesday.csv"]})
        assert answer.status_code == 202, answer.text
    monkeypatch.setattr("tauscope.server.http.services.PRUNING_S", 0.05)
    return folder


def test_what_is_old_goes_while_the_service_works(data: Path) -> None:
    settings = Settings(data_folder=data, prune_older_than_days=0.0, prune_recordings=True, fires_schedules=False)
    with connected(create_app(settings, ManualExecutor())) as client:
        wait_until(lambda: not [each for each in items(client) if each["kind"] != "identification"])
        states = {each["state"]: each["id"] for each in items(client)}
        assert set(states) == {"succeeded", "running", "damaged"}
        (active,) = [each["id"] for each in client.get("/api/v1/models").json()["models"] if each["state"] == "active"]
        assert states["succeeded"] == active
        # Of these the active model was made, and the job that still goes on works with them.
        names = {"monday.csv", "tuesday.csv", "wednesday.csv"}
        wait_until(lambda: {each["name"] for each in client.get(RECORDINGS).json()["recordings"]} == names)
    told = [json.loads(line) for line in AuditLog(data).path.read_text().splitlines()]
    gone = [entry for entry in told if entry["action"] == "pruned"]
    assert {entry["actor"] for entry in gone} == {"service"}
    assert {entry["kind"] for entry in gone} >= {"run", "campaign", "diagnosis", "excitation", "recording"}
    assert active not in {entry["subject"] for entry in gone}


def items(client: TestClient) -> list[dict[str, Any]]:
    answer = client.get(ITEMS, params={"limit": 1000})
    return answer.json()["items"]


def test_nothing_goes_where_nobody_asked_for_it(data: Path) -> None:
    before = set(data.rglob("result.json"))
    with connected(create_app(Settings(data_folder=data, prune_recordings=True), InlineExecutor())) as client:
        assert client.get(ITEMS).status_code == 200
    assert set(data.rglob("result.json")) == before


def test_the_words_of_the_command(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Settings] = []
    monkeypatch.setattr("tauscope.server.http.app.serve", lambda settings, _: seen.append(settings))
    words = ["serve", "--data", str(data), "--prune-older-than", "90", "--prune-kind", "run", "--prune-recordings"]
    assert main(words) == 0
    found = (seen[0].prune_older_than_days, seen[0].prune_kinds, seen[0].prune_recordings)
    assert found == (90.0, ("run",), True)
    assert main(["serve", "--data", str(data), "--prune-recordings"]) == 2
