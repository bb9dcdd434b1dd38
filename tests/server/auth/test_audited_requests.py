"""Which requests leave which entries, and what happens where the log takes none."""

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from server.auth.keyed import client_with, make_keys
from server.conftest import HOST, IDENTIFICATIONS, RECORDINGS, connected
from server.http.contract.test_route_scopes import CHANGING
from server.http.motions import ROBOT, move_document
from server.queue.controls import HandControls, finish_at_once
from server.queue.executors import InlineExecutor
from tauscope.server.auth.audit_log import AuditLog
from tauscope.server.auth.keys import Scope, find_needed_scope
from tauscope.server.http import Settings, create_app

RUNS, LEASES = "/api/v1/runs", "/api/v1/leases"
MOVING = (Scope.MOVE, Scope.ADMIN)
MOTION = {"robot": ROBOT, "trajectory": move_document()}


def entries_after(settings: Settings, act: Callable[[TestClient], Any]) -> list[dict[str, Any]]:
    """What the log holds once the service has ended, without beginning and end."""
    with connected(create_app(settings, InlineExecutor(), finish_at_once)) as client:
        act(client)
    log = AuditLog(settings.data_folder)
    assert log.verify().fault is None
    first, *entries, last = [json.loads(line) for line in log.path.read_text().splitlines()]
    assert (first["action"], last["action"]) == ("began", "ended")
    return entries


def test_a_run_leaves_an_entry_before_and_after(settings: Settings) -> None:
    runs: list[dict[str, Any]] = []
    entries = entries_after(settings, lambda client: runs.append(client.post(RUNS, json=MOTION).json()))
    assert [entry["action"] for entry in entries] == [f"asked: POST {RUNS}", f"POST {RUNS}"]
    assert [entry["actor"] for entry in entries] == ["local", "local"]
    assert (entries[1]["status"], entries[1]["subject"]) == (202, f"{RUNS}/{runs[0]['id']}")


def test_reading_leaves_none_and_refusals_do(settings: Settings) -> None:
    def act(client: TestClient) -> None:
        client.get(RUNS)
        client.get("/metrics")
        client.delete(f"{RECORDINGS}/nothing.csv")
        client.post(IDENTIFICATIONS, json={"x": 1})

    entries = entries_after(settings, act)
    assert [(entry["action"], entry.get("status")) for entry in entries] == [
        (f"asked: DELETE {RECORDINGS}/nothing.csv", None),
        (f"DELETE {RECORDINGS}/nothing.csv", 404),
        (f"POST {IDENTIFICATIONS}", 422),
    ]


def test_every_operation_that_changes_something_leaves_an_entry(settings: Settings) -> None:
    """Signs of life apart, of which there are many."""
    asked = [operation.split(" ") for operation in CHANGING if not operation.endswith("/heartbeat")]
    addresses = [(method, re.sub(r"\{\w+\}", "7", path)) for method, path in asked]
    entries = entries_after(settings, lambda client: [client.request(*address) for address in addresses])
    noted = [entry["action"] for entry in entries if "status" in entry]
    assert noted == [f"{method} {path}" for method, path in addresses]
    first = [entry["action"] for entry in entries if entry["action"].startswith("asked: ")]
    moves = [f"asked: {method} {path}" for method, path in addresses if find_needed_scope(method, path) in MOVING]
    assert first == moves
    assert len(moves) > 10


def test_entries_name_the_key_and_hold_no_secret(settings: Settings) -> None:
    keys = make_keys(settings.data_folder)
    app = create_app(settings, InlineExecutor(), finish_at_once)
    with TestClient(app, base_url=HOST):
        mover = client_with(app, keys[Scope.MOVE])
        lease = mover.post(LEASES, json={"robot": "two-joint-arm"}).json()
        mover.post(lease["links"]["heartbeat"], headers={"Lease-Token": lease["token"]})
        client_with(app, keys[Scope.READ]).post(RUNS, json=MOTION)
        client_with(app, "tsk_00000000_guess").post(RUNS, json=MOTION)
        mover.delete(lease["links"]["self"], headers={"Lease-Token": lease["token"]})
    text = AuditLog(settings.data_folder).path.read_text()
    said = [(entry["actor"], entry["action"]) for entry in map(json.loads, text.splitlines())]
    assert ("move", f"POST {LEASES}") in said
    assert said.count(("somebody", f"refused: POST {RUNS}")) == 2
    assert ("service", "lease ended") in said
    assert not [action for _, action in said if "heartbeat" in action]
    for secret in (*keys.values(), lease["token"], "tsk_"):
        assert secret not in text


@pytest.fixture
def deaf(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> tuple[FastAPI, HandControls]:
    """A service whose log can be made to take nothing any more."""
    controls = HandControls()
    controls.obey = True
    return create_app(settings, InlineExecutor(), controls), controls


def test_where_the_log_takes_nothing_nothing_moves_and_everything_stops(
    deaf: tuple[FastAPI, HandControls], monkeypatch: pytest.MonkeyPatch
) -> None:
    app, controls = deaf
    with connected(app) as client:
        run = client.post(RUNS, json=MOTION).json()
        control = controls.next()

        def full(*_: Any, **__: Any) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(AuditLog, "append", full)
        other = {**ROBOT, "name": "another-arm"}
        answer = client.post(RUNS, json={"robot": other, "trajectory": {**move_document(), "robot": "another-arm"}})
        assert answer.status_code == 507
        assert len(controls.started) == 1
        assert client.post(run["links"]["stop"]).status_code == 202
        assert control.stops == 1
