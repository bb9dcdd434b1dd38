"""Requests with keys, without, with wrong ones, and too many of them."""

import logging
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from server.auth.keyed import client_with, make_keys
from server.conftest import HOST, IDENTIFICATIONS, RECORDINGS
from server.http.motions import ROBOT, move_document
from server.http.problem_check import assert_problem
from server.queue.controls import HandControls
from server.queue.executors import InlineExecutor
from tauscope.server.auth.gate import RateLimit
from tauscope.server.auth.keys import CHECK_S, KeyFile, Scope
from tauscope.server.http import Settings, create_app
from tauscope.server.http.services import Services

RUNS = "/api/v1/runs"


@pytest.fixture
def keys(settings: Settings) -> dict[Scope, str]:
    return make_keys(settings.data_folder)


@pytest.fixture
def controls() -> HandControls:
    return HandControls()


@pytest.fixture
def app(settings: Settings, keys: dict[Scope, str], controls: HandControls) -> Iterator[FastAPI]:
    app = create_app(settings, InlineExecutor(), controls)
    with TestClient(app, base_url=HOST):
        try:
            yield app
        finally:
            controls.obey_from_now_on()


def begin_run(app: FastAPI, keys: dict[Scope, str]) -> str:
    client = client_with(app, keys[Scope.MOVE])
    lease = client.post("/api/v1/leases", json={"robot": "two-joint-arm"}).json()
    token = {"Lease-Token": lease["token"]}
    client.post(lease["links"]["arm"], headers=token)
    answer = client.post(RUNS, json={"robot": ROBOT, "trajectory": move_document()}, headers=token)
    assert answer.status_code == 202, answer.text
    return answer.json()["links"]["stop"]


@pytest.mark.parametrize(
    "headers",
    [
        [],
        [("authorization", "")],
        [("authorization", "Bearer")],
        [("authorization", "Bearer ")],
        [("authorization", "Basic {key}")],
        [("authorization", "{key}")],
        [("authorization", "Bearer {key}x")],
        [("authorization", "Bearer {key}"), ("authorization", "Bearer {key}")],
        [("x-api-key", "{key}")],
        [("cookie", "authorization=Bearer {key}")],
        [("x-forwarded-for", "127.0.0.1"), ("x-real-ip", "127.0.0.1")],
    ],
    ids=[
        "none",
        "empty",
        "bare",
        "blank",
        "basic",
        "no scheme",
        "one too long",
        "twice",
        "elsewhere",
        "cookie",
        "spoof",
    ],
)
def test_whoever_has_no_key_is_told_so(headers: list[tuple[str, str]], app: FastAPI, keys: dict[Scope, str]) -> None:
    sent = [(name, value.format(key=keys[Scope.ADMIN])) for name, value in headers]
    answer = client_with(app, None).get(IDENTIFICATIONS, headers=sent)
    assert_problem(answer, "unauthorized", 401)
    assert answer.headers["www-authenticate"] == "Bearer"


def test_the_key_is_taken_from_the_header_only(app: FastAPI, keys: dict[Scope, str]) -> None:
    key = keys[Scope.READ]
    assert client_with(app, key).get(IDENTIFICATIONS).status_code == 200
    assert client_with(app, None).get(IDENTIFICATIONS, headers={"authorization": f"bearer  {key} "}).status_code == 200
    for query in (f"?key={key}", f"?access_token={key}", f"?authorization=Bearer%20{key}"):
        assert client_with(app, None).get(IDENTIFICATIONS + query).status_code == 401


def test_pages_and_health_need_no_key(app: FastAPI) -> None:
    for path in ("/healthz", "/docs", "/docs/pages.css", "/docs/errors/unauthorized", "/openapi.json"):
        assert client_with(app, None).get(path).status_code == 200, path


def test_what_is_not_there_is_not_told_to_strangers(app: FastAPI) -> None:
    assert_problem(client_with(app, None).get("/api/v1/nothing"), "unauthorized", 401)


@pytest.mark.parametrize("scope", [Scope.READ, Scope.ANALYSE])
def test_a_key_below_move_moves_nothing(
    scope: Scope, app: FastAPI, keys: dict[Scope, str], controls: HandControls
) -> None:
    answer = client_with(app, keys[scope]).post(RUNS, json={"robot": ROBOT, "trajectory": move_document()})
    assert "scope move" in assert_problem(answer, "forbidden", 403)["detail"]
    assert controls.started == []


def test_a_body_without_a_key_is_not_kept(app: FastAPI, settings: Settings) -> None:
    answer = client_with(app, None).post(RECORDINGS, files={"file": ("log.csv", b"x" * 2**20)})
    assert_problem(answer, "unauthorized", 401)
    assert [entry.name for entry in settings.recordings_folder.iterdir()] == [".sha256"]


def test_every_key_stops_an_arm_an_expired_one_too(
    app: FastAPI, keys: dict[Scope, str], controls: HandControls, settings: Settings
) -> None:
    stop = begin_run(app, keys)
    past = datetime.now(UTC) - timedelta(days=2)
    _, expired = KeyFile(settings.data_folder).add("expired", Scope.READ, past, timedelta(days=1))
    services: Services = app.state.services
    services.access.ring.look()
    assert client_with(app, expired).get(RUNS).status_code == 401
    for number, key in enumerate([*keys.values(), expired], start=1):
        assert client_with(app, key).post(stop).status_code == 202
        assert controls.next().stops == number
    assert_problem(client_with(app, None).post(stop), "unauthorized", 401)


def test_a_revoked_key_is_refused_while_the_service_runs(
    app: FastAPI, keys: dict[Scope, str], settings: Settings
) -> None:
    client = client_with(app, keys[Scope.READ])
    assert client.get(RUNS).status_code == 200
    KeyFile(settings.data_folder).revoke("read", datetime.now(UTC))
    services: Services = app.state.services
    services.access.ring.look()
    assert_problem(client.get(RUNS), "unauthorized", 401)
    assert CHECK_S <= 1.0


def test_a_key_may_not_call_without_end_but_may_always_stop(
    app: FastAPI, keys: dict[Scope, str], controls: HandControls
) -> None:
    stop = begin_run(app, keys)
    services: Services = app.state.services
    object.__setattr__(services.access, "rate", RateLimit(0.5, 3.0, clock=lambda: 0.0))
    client, other = client_with(app, keys[Scope.READ]), client_with(app, keys[Scope.MOVE])
    assert [client.get(RUNS).status_code for _ in range(4)] == [200, 200, 200, 429]
    answer = client.get(RUNS)
    assert_problem(answer, "rate-limited", 429)
    assert answer.headers["retry-after"] == "2"
    assert other.get(RUNS).status_code == 200
    assert [client.post(stop).status_code for _ in range(10)] == [202] * 10
    assert controls.next().stops == 10


def test_who_tries_keys_has_to_wait_and_right_keys_pass(app: FastAPI, keys: dict[Scope, str]) -> None:
    stranger = client_with(app, "tsk_00000000_guess")
    statuses = [stranger.get(RUNS).status_code for _ in range(40)]
    assert statuses[:20] == [401] * 20
    assert 429 in statuses[20:]
    assert client_with(app, keys[Scope.READ]).get(RUNS).status_code == 200


def test_a_service_without_keys_is_as_it_was(client: TestClient) -> None:
    assert [client.get(IDENTIFICATIONS).status_code for _ in range(450)] == [200] * 450


def test_no_key_is_ever_logged(app: FastAPI, keys: dict[Scope, str], caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    for key in (*keys.values(), "tsk_00000000_guess"):
        client_with(app, key).get(RUNS)
        client_with(app, key).get("/api/v1/nothing")
    said = caplog.text + "".join(str(vars(record)) for record in caplog.records)
    assert "tsk_" not in said


def test_a_key_sends_so_much_in_a_day_and_others_have_room(app: FastAPI, keys: dict[Scope, str]) -> None:
    services: Services = app.state.services
    object.__setattr__(services.access, "uploads", RateLimit(1.0, 1000.0, clock=lambda: 0.0))
    flood, other = client_with(app, keys[Scope.ANALYSE]), client_with(app, keys[Scope.MOVE])
    assert flood.post("/api/v1/recordings", files={"file": ("a.csv", bytes(2000))}).status_code == 201
    answer = flood.post("/api/v1/recordings", files={"file": ("b.csv", b"t")})
    assert "sent as much as it may in a day" in assert_problem(answer, "rate-limited", 429)["detail"]
    assert int(answer.headers["retry-after"]) > 1000
    assert other.post("/api/v1/recordings", files={"file": ("b.csv", b"t")}).status_code == 201
