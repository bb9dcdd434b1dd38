"""Leases over HTTP, and the motion that depends on them: with keys always, without keys as soon as somebody has one."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from server.auth.keyed import client_with, make_keys
from server.conftest import HOST, connected
from server.http.event_stream import read_events
from server.http.motions import ROBOT, move_document
from server.http.problem_check import assert_problem
from server.queue.controls import HandControls
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.waiting import wait_until
from tauscope.runtime.states import RunState
from tauscope.server.auth.keys import Scope
from tauscope.server.control.leases import Lease
from tauscope.server.http import Settings, create_app
from tauscope.server.http.services import Services

LEASES, RUNS, CAMPAIGNS, STOP = (f"/api/v1/{name}" for name in ("leases", "runs", "campaigns", "stop"))
ARM: dict[str, Any] = {"robot": "two-joint-arm", "backend": "sim"}
MOTION = {"robot": ROBOT, "trajectory": move_document()}


@pytest.fixture
def controls() -> HandControls:
    return HandControls()


@pytest.fixture
def app(settings: Settings, controls: HandControls) -> Iterator[FastAPI]:
    app = create_app(settings, InlineExecutor(), controls)
    with TestClient(app, base_url=HOST):
        try:
            yield app
        finally:
            controls.obey_from_now_on()


@pytest.fixture
def arm(app: FastAPI) -> TestClient:
    """Anybody on this machine, of a service without keys."""
    return client_with(app, None)


@pytest.fixture
def keys(settings: Settings) -> dict[Scope, str]:
    return make_keys(settings.data_folder)


def take(client: TestClient, **changes: Any) -> dict[str, Any]:
    answer = client.post(LEASES, json={**ARM, **changes})
    assert answer.status_code == 201, answer.text
    assert answer.headers["location"] == answer.json()["links"]["self"]
    return answer.json()


def with_token(lease: dict[str, Any]) -> dict[str, str]:
    return {"Lease-Token": lease["token"]}


def armed(client: TestClient, **changes: Any) -> dict[str, Any]:
    lease = take(client, **changes)
    assert client.post(lease["links"]["arm"], headers=with_token(lease)).json()["armed"] is True
    return lease


def state_of(client: TestClient, run: dict[str, Any]) -> str:
    return client.get(run["links"]["self"]).json()["state"]


def let_expire(app: FastAPI, lease: dict[str, Any]) -> None:
    """As if its time had passed."""
    services: Services = app.state.services
    held = services.leases.find(lease["id"])
    assert isinstance(held, Lease)
    held.ends = 0.0


def test_without_keys_and_leases_everything_is_as_the_contract_says(arm: TestClient, controls: HandControls) -> None:
    answer = arm.post(RUNS, json=MOTION)
    assert answer.status_code == 202
    controls.next().go(RunState.RUNNING)
    assert_problem(arm.post(LEASES, json=ARM), "busy", 409)


def test_a_lease_from_its_beginning_to_its_end(arm: TestClient) -> None:
    lease = take(arm, holder="Ann", ttl_s=30.0)
    assert (lease["arm"], lease["holder"], lease["armed"]) == ("two-joint-arm on sim", "Ann", False)
    assert 25.0 < lease["seconds_left"] <= 30.0
    (listed,) = arm.get(LEASES).json()["leases"]
    assert listed["token"] is None
    assert lease["token"] not in arm.get(lease["links"]["self"]).text
    beat = arm.post(lease["links"]["heartbeat"], headers=with_token(lease))
    assert (beat.status_code, beat.json()["number"]) == (200, lease["number"])
    assert arm.delete(lease["links"]["self"], headers=with_token(lease)).status_code == 204
    assert arm.get(LEASES).json() == {"leases": []}
    assert_problem(arm.get(lease["links"]["self"]), "not-found", 404)
    assert_problem(arm.delete(lease["links"]["self"], headers=with_token(lease)), "lease-lost", 409)
    assert take(arm)["number"] == lease["number"] + 1


def test_who_has_the_lease_moves_the_arm_and_nobody_else(arm: TestClient, controls: HandControls) -> None:
    lease = take(arm)
    for path, body in ((RUNS, MOTION), (CAMPAIGNS, {"robot": ROBOT})):
        assert_problem(arm.post(path, json=body), "leased", 409)
        assert_problem(arm.post(path, json=body, headers={"Lease-Token": "1-x"}), "lease-lost", 409)
        assert_problem(arm.post(path, json=body, headers=with_token(lease)), "not-armed", 409)
    arm.post(lease["links"]["arm"], headers=with_token(lease))
    assert arm.post(RUNS, json=MOTION, headers=with_token(lease)).status_code == 202
    assert len(controls.started) == 1 or controls.next()
    other = {**ROBOT, "name": "another-arm"}
    answer = arm.post(RUNS, json={"robot": other, "trajectory": {**move_document(), "robot": "another-arm"}})
    assert answer.status_code == 202, answer.text


@pytest.mark.parametrize("way", ["expiry", "release", "disarm", "taken"])
def test_when_the_lease_ends_the_arm_stops(way: str, app: FastAPI, arm: TestClient, controls: HandControls) -> None:
    lease = armed(arm, holder="Ann")
    run = arm.post(RUNS, json=MOTION, headers=with_token(lease)).json()
    control = controls.next()
    control.go(RunState.RUNNING)
    assert control.stops == 0
    if way == "expiry":
        let_expire(app, lease)
    elif way == "release":
        arm.delete(lease["links"]["self"], headers=with_token(lease))
    elif way == "disarm":
        arm.post(lease["links"]["disarm"], headers=with_token(lease))
    else:
        take(arm, holder="Eve", take=True)
    assert control.when_stopped()
    beats = control.beats
    control.finish(RunState.STOPPED)
    wait_until(lambda: state_of(arm, run) == "stopped")
    assert control.beats == beats  # from the lease's end on the control process heard nothing of its owner
    told = [event.data.get("step", "") for event in read_events(arm.get(run["links"]["events"]).text.split("\n"))]
    assert any(step.startswith("stop: lease 1 of Ann") for step in told)


def test_a_lease_that_ends_while_the_motion_is_designed_moves_nothing(settings: Settings) -> None:
    executor, controls = ManualExecutor(), HandControls()
    app = create_app(settings, executor, controls)
    with connected(app) as arm:
        lease = armed(arm)
        run = arm.post(RUNS, json={"robot": ROBOT}, headers=with_token(lease)).json()
        let_expire(app, lease)
        executor.run()
        wait_until(lambda: state_of(arm, run) == "failed")
        assert arm.get(run["links"]["self"]).json()["problem"]["code"] == "acquisition"
    assert controls.started == []


def test_a_stop_needs_no_lease_and_disarms(arm: TestClient, controls: HandControls) -> None:
    lease = armed(arm)
    run = arm.post(RUNS, json=MOTION, headers=with_token(lease)).json()
    control = controls.next()
    control.go(RunState.RUNNING)
    assert arm.post(run["links"]["stop"]).status_code == 202
    control.finish(RunState.STOPPED)
    wait_until(lambda: state_of(arm, run) == "stopped")
    assert_problem(arm.post(RUNS, json=MOTION, headers=with_token(lease)), "not-armed", 409)
    arm.post(lease["links"]["arm"], headers=with_token(lease))
    wait_until(lambda: arm.post(RUNS, json=MOTION, headers=with_token(lease)).status_code == 202)


def test_everything_is_stopped_at_once(arm: TestClient, controls: HandControls) -> None:
    lease = armed(arm)
    run = arm.post(RUNS, json=MOTION, headers=with_token(lease)).json()
    control = controls.next()
    for number in (1, 2):
        answer = arm.post(STOP)
        assert answer.status_code == 202
        assert (answer.json()["runs"], answer.json()["campaigns"]) == ([run["id"]], [])
        assert control.stops >= number
    assert arm.get(lease["links"]["self"]).json()["armed"] is False
    control.finish(RunState.STOPPED)
    wait_until(lambda: arm.post(STOP).json()["runs"] == [])


def test_with_keys_motion_needs_a_lease_of_the_very_key(
    keys: dict[Scope, str], app: FastAPI, controls: HandControls
) -> None:
    mover, admin = client_with(app, keys[Scope.MOVE]), client_with(app, keys[Scope.ADMIN])
    assert_problem(mover.post(RUNS, json=MOTION), "lease-needed", 428)
    assert_problem(mover.post(CAMPAIGNS, json={"robot": ROBOT}), "lease-needed", 428)
    lease = armed(mover)
    assert lease["holder"] == "move"
    assert_problem(admin.post(RUNS, json=MOTION, headers=with_token(lease)), "lease-lost", 409)
    assert_problem(admin.post(lease["links"]["heartbeat"], headers=with_token(lease)), "lease-lost", 409)
    assert_problem(mover.post(LEASES, json={**ARM, "take": True}), "forbidden", 403)
    assert controls.started == []
    assert mover.post(RUNS, json=MOTION, headers=with_token(lease)).status_code == 202
    control = controls.next()
    taken = take(admin, take=True)
    assert control.when_stopped()
    assert taken["number"] > lease["number"]
    assert_problem(mover.post(lease["links"]["heartbeat"], headers=with_token(lease)), "lease-lost", 409)


def test_a_lease_can_be_asked_for_without_keys(settings: Settings, controls: HandControls) -> None:
    strict = settings.model_copy(update={"require_lease": True})
    with connected(create_app(strict, InlineExecutor(), controls)) as client:
        assert_problem(client.post(RUNS, json=MOTION), "lease-needed", 428)


def test_fifty_requests_for_one_arm(arm: TestClient, app: FastAPI) -> None:
    begin, statuses = threading.Barrier(50), []

    def want() -> None:
        client = client_with(app, None)
        begin.wait()
        statuses.append(client.post(LEASES, json=ARM).status_code)

    threads = [threading.Thread(target=want) for _ in range(50)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(statuses) == [201] + [409] * 49
    assert len(arm.get(LEASES).json()["leases"]) == 1


@pytest.mark.parametrize(
    "change", [{"ttl_s": 0.5}, {"ttl_s": 61.0}, {"ttl_s": "10"}, {"robot": ""}, {"backend": "x"}, {"token": "1-x"}]
)
def test_requests_that_are_refused(change: dict[str, Any], arm: TestClient) -> None:
    assert_problem(arm.post(LEASES, json={**ARM, **change}), "invalid-request", 422)
    assert arm.get(LEASES).json() == {"leases": []}
