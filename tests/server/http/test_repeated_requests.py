"""POSTs with an Idempotency-Key: done once, whoever repeats them, whatever happened in between."""

import threading
from itertools import pairwise
from typing import Any

import pytest
from fastapi import FastAPI
from hypothesis import given
from hypothesis import strategies as st
from starlette.testclient import TestClient

from server.auth.keyed import client_with, make_keys
from server.conftest import HOST, IDENTIFICATIONS, RECORDINGS, connected
from server.http.motions import ROBOT, move_document
from server.http.problem_check import assert_problem
from server.queue.controls import HandControls, finish_at_once
from server.queue.executors import InlineExecutor
from tauscope.server.auth.keys import Scope
from tauscope.server.control.run_manager import RunManager
from tauscope.server.http import Settings, create_app
from tauscope.server.http.repeated_requests import LIFE_S, Fingerprint, KeptAnswer, StoredAnswers
from tauscope.server.http.services import Services

RUNS, LEASES = "/api/v1/runs", "/api/v1/leases"
MOTION = {"robot": ROBOT, "trajectory": move_document()}
ONCE = {"Idempotency-Key": "6f2b6d0e-once"}


@pytest.fixture
def controls() -> HandControls:
    controls = HandControls()
    controls.obey = True
    return controls


@pytest.fixture
def app(settings: Settings, controls: HandControls) -> FastAPI:
    return create_app(settings, InlineExecutor(), controls)


def test_a_run_is_begun_once(app: FastAPI, controls: HandControls) -> None:
    with connected(app) as client:
        first, second = (client.post(RUNS, json=MOTION, headers=ONCE) for _ in range(2))
        assert (first.status_code, second.status_code) == (202, 202)
        assert first.content == second.content
        assert second.headers["location"] == first.headers["location"]
        assert ("idempotency-replayed" in first.headers, second.headers["idempotency-replayed"]) == (False, "true")
        assert len(client.get(RUNS).json()["runs"]) == 1
        controls.next()
        assert len(controls.started) == 1


def test_it_is_remembered_over_a_restart(settings: Settings) -> None:
    ids = []
    for _ in range(2):
        with connected(create_app(settings, InlineExecutor(), finish_at_once)) as client:
            ids.append(client.post(RUNS, json=MOTION, headers=ONCE).json()["id"])
            assert len(client.get(RUNS).json()["runs"]) == 1
    assert ids[0] == ids[1]


def test_another_body_is_another_request(app: FastAPI, controls: HandControls) -> None:
    with connected(app) as client:
        client.post(RUNS, json=MOTION, headers=ONCE)
        answer = client.post(RUNS, json={**MOTION, "rate_hz": 250.0}, headers=ONCE)
        assert_problem(answer, "key-reused", 422)
        assert len(client.get(RUNS).json()["runs"]) == 1


def test_a_form_is_the_same_under_another_boundary(client: TestClient) -> None:
    answers = [client.post(RECORDINGS, files={"file": ("a.csv", b"t,q1,tau1\n")}, headers=ONCE) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [201, 201]
    assert answers[1].headers["idempotency-replayed"] == "true"
    other = client.post(RECORDINGS, files={"file": ("a.csv", b"t,q1,tau2\n")}, headers=ONCE)
    assert_problem(other, "key-reused", 422)


def test_what_was_refused_may_be_corrected(app: FastAPI) -> None:
    with connected(app) as client:
        assert client.post(RUNS, json={**MOTION, "rate_hz": -1}, headers=ONCE).status_code == 422
        assert client.post(RUNS, json=MOTION, headers=ONCE).status_code == 202


def test_a_service_that_was_killed_in_between_never_moves_twice(settings: Settings) -> None:
    """The request was begun, and whether the arm moved nobody knows."""
    with connected(create_app(settings, InlineExecutor(), finish_at_once)) as client:
        client.post(RUNS, json=MOTION, headers=ONCE)
        (kept,) = (settings.data_folder / "idempotency").iterdir()
        kept.write_bytes(b"")
        answer = client.post(RUNS, json=MOTION, headers=ONCE)
        assert "look into the list" in assert_problem(answer, "not-repeatable", 409)["detail"]
        assert len(client.get(RUNS).json()["runs"]) == 1


def test_a_fault_of_our_own_is_not_tried_again(
    app: FastAPI, controls: HandControls, monkeypatch: pytest.MonkeyPatch
) -> None:
    with connected(app) as client:
        live = RunManager.live
        monkeypatch.setattr(RunManager, "live", lambda *_: (_ for _ in ()).throw(KeyError("x")))
        assert client.post(RUNS, json=MOTION, headers=ONCE).status_code == 500
        monkeypatch.setattr(RunManager, "live", live)
        assert_problem(client.post(RUNS, json=MOTION, headers=ONCE), "not-repeatable", 409)
        controls.next()
        assert len(controls.started) == 1


def test_twenty_at_once_move_the_arm_once(app: FastAPI, controls: HandControls) -> None:
    with connected(app) as client:
        begin, answers = threading.Barrier(20), []

        def ask() -> None:
            mine = client_with(app, None)
            begin.wait()
            answers.append(mine.post(RUNS, json=MOTION, headers=ONCE))

        threads = [threading.Thread(target=ask) for _ in range(20)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert {answer.status_code for answer in answers} <= {202, 409}
        assert len({answer.json()["id"] for answer in answers if answer.status_code == 202}) == 1
        assert {answer.json()["code"] for answer in answers if answer.status_code == 409} <= {"not-repeatable"}
        assert len(client.get(RUNS).json()["runs"]) == 1


def test_nobody_gets_the_answer_of_another_caller(settings: Settings) -> None:
    keys = make_keys(settings.data_folder)
    app = create_app(settings, InlineExecutor(), finish_at_once)
    with TestClient(app, base_url=HOST):
        upload: dict[str, Any] = {"files": {"file": ("a.csv", b"t,q1,tau1\n")}, "headers": ONCE}
        assert client_with(app, keys[Scope.ANALYSE]).post(RECORDINGS, **upload).status_code == 201
        assert client_with(app, keys[Scope.ADMIN]).post(RECORDINGS, **upload).status_code == 200
        assert client_with(app, keys[Scope.READ]).post(RECORDINGS, **upload).status_code == 403
        assert client_with(app, None).post(RECORDINGS, **upload).status_code == 401


@pytest.mark.parametrize("key", ["", "a b", "é", "x" * 201])
def test_keys_that_are_none(key: str, client: TestClient) -> None:
    answer = client.post(IDENTIFICATIONS, json={}, headers=[("idempotency-key", key.encode("latin-1"))])  # type: ignore[list-item]
    assert "Idempotency-Key" in assert_problem(answer, "invalid-request", 422)["detail"]


def test_answers_are_forgotten_after_a_day(settings: Settings) -> None:
    folder, now = settings.data_folder / "answers", [0.0]
    store = StoredAnswers(folder, clock=lambda: now[0])
    assert store.begin("a")
    store.finish("a", KeptAnswer(fingerprint="f", status=202, headers=(("x", "y"),), body=""))
    now[0] = (folder / "a").stat().st_mtime + LIFE_S - 1.0
    assert not StoredAnswers(folder, clock=lambda: now[0]).begin("a")
    now[0] += 2.0
    assert StoredAnswers(folder, clock=lambda: now[0]).begin("a")


@given(body=st.binary(max_size=200), cuts=st.lists(st.integers(0, 400), max_size=6))
def test_the_fingerprint_does_not_depend_on_the_pieces_nor_on_the_boundary(body: bytes, cuts: list[int]) -> None:
    digests = set()
    for boundary in (b"AaB03x", b"another-and-longer-boundary"):
        whole = b"--" + boundary + b"\r\n\r\n" + body + b"\r\n--" + boundary + b"--\r\n"
        mark = Fingerprint(f"multipart/form-data; boundary={boundary.decode()}")
        places = [0, *sorted(cut % (len(whole) + 1) for cut in cuts), len(whole)]
        for start, stop in pairwise(places):
            mark.add(whole[start:stop])
        digests.add(mark.digest())
    assert len(digests) == 1


def test_services_hold_the_store(app: FastAPI) -> None:
    with connected(app):
        services: Services = app.state.services
        assert isinstance(services.answers, StoredAnswers)


def test_a_lease_is_taken_once_and_its_secret_is_on_no_disk(settings: Settings) -> None:
    """It is exclusive anyway: who lost the answer waits until it ends without a sign of life."""
    wanted = {"robot": "two-joint-arm", "backend": "sim"}
    with connected(create_app(settings, InlineExecutor())) as client:
        first, second = (client.post(LEASES, json=wanted, headers=ONCE) for _ in range(2))
        assert first.status_code == 201
        assert_problem(second, "leased", 409)
        token = first.json()["token"].encode()
        assert not [path for path in settings.data_folder.rglob("*") if path.is_file() and token in path.read_bytes()]
