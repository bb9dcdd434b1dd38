"""Identifications over HTTP: handed in, followed, fetched, cancelled, removed."""

import json
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS, connected
from server.http.problem_check import assert_problem
from server.queue.executors import InlineExecutor, ManualExecutor
from tauscope.identification import IdentificationDocument
from tauscope.server.http import Settings, create_app
from tauscope.server.queue.queue import MOST_ATTEMPTS

Files = list[tuple[str, tuple[str, bytes]]]
QUICK = {"options": {"cutoff_hz": None}}


@pytest.fixture
def files(paper_robot: bytes, paper_recordings: tuple[bytes, bytes]) -> Files:
    return [("robot", ("arm.yaml", paper_robot)), ("recordings", ("train.csv", paper_recordings[0]))]


@pytest.fixture
def inline_robot() -> dict[str, Any]:
    rows = [{"theta": 0.0, "d": 0.3, "a": 0.0, "alpha": 1.5707963267948966}] + [
        {"theta": theta, "d": 0.0, "a": 0.5, "alpha": 0.0} for theta in (1.5707963267948966, 0.0)
    ]
    shape = {"k_v": 500, "delta": 10}
    joints = [{"name": f"joint{number}", "friction_shape": shape} for number in (1, 2, 3)]
    return {"name": "inline-arm", "kinematics": {"dh": rows}, "joints": joints}


def form(request: dict[str, Any]) -> dict[str, str]:
    return {"request": json.dumps(request)}


def test_columns_of_another_tool(client: TestClient, files: Files) -> None:
    name, content = files[1][1]
    header, _, rows = content.partition(b"\n")
    foreign = header.replace(b"tau", b"effort_").replace(b"t,", b"clock;", 1).replace(b",", b";")
    files[1] = ("recordings", (name, foreign + b"\n" + rows.replace(b",", b";").replace(b".", b",")))
    columns = {"t": "clock", "tau": "effort_{1}"}
    sent = {"options": {"cutoff_hz": None, "columns": columns, "decimal": ",", "delimiter": "semicolon"}}
    accepted = client.post(IDENTIFICATIONS, files=files, data=form(sent))
    assert accepted.status_code == 202, accepted.text
    assert client.get(accepted.headers["location"]).json()["state"] == "succeeded"
    for wrong in ({"columns": "rdte"}, {"columns": {"x": "a"}}, {"decimal": "'"}):
        refused = client.post(IDENTIFICATIONS, files=files, data=form({"options": wrong}))
        assert_problem(refused, "invalid-request", 422)


def test_uploaded_files_all_the_way(client: TestClient, files: Files, paper_recordings: tuple[bytes, bytes]) -> None:
    files.append(("held_out", ("test.csv", paper_recordings[1])))
    accepted = client.post(IDENTIFICATIONS, files=files, data=form(QUICK))
    assert accepted.status_code == 202
    here = accepted.headers["location"]
    assert here == f"{IDENTIFICATIONS}/{accepted.json()['id']}"

    status = client.get(here).json()
    assert status["state"] == "succeeded"
    assert status["robot"] == "paper-arm"
    layout = dict.fromkeys(("units", "rate_hz", "columns", "decimal", "delimiter", "topic"))
    read_as = {**layout, "trust_units": False}
    assert status["options"] == {"estimator": "wls", "cutoff_hz": None, "rotor_inertia": True, "prior": True, **read_as}
    assert [(entry["name"], entry["origin"]) for entry in status["recordings"]] == [("train.csv", "uploaded")]
    assert status["created"] <= status["started"] <= status["ended"]

    result = client.get(status["links"]["result"])
    assert result.headers["content-type"] == "application/json"
    document = IdentificationDocument.model_validate_json(result.content)
    assert document.robot == "paper-arm"
    assert document.fit.held_out is not None

    exports = {name: client.get(link) for name, link in status["links"]["exports"].items()}
    assert set(exports) == {"json", "yaml", "c", "python", "mjcf"}
    assert exports["json"].json()["joints"][0]["torque"]["stiction"] == document.friction[0].stiction
    assert "#ifndef" in exports["c"].text
    assert exports["c"].headers["content-disposition"] == 'attachment; filename="friction.h"'
    compile(exports["python"].text, "friction.py", "exec")
    assert exports["mjcf"].text.startswith("<mujoco")
    assert "URDF" in assert_problem(client.get(f"{here}/exports/urdf"), "export", 409)["detail"]
    assert list(status["refused_exports"]) == ["urdf"]

    assert [entry["id"] for entry in client.get(IDENTIFICATIONS).json()["identifications"]] == [status["id"]]
    assert_problem(client.delete(here), "in-use", 409)  # it has become the active model


def test_an_identification_is_removed(client: TestClient, files: Files) -> None:
    here = client.post(IDENTIFICATIONS, files=files, data=form(QUICK)).headers["location"]
    assert client.get(here).json()["state"] == "succeeded"
    assert client.delete(here).status_code == 204
    assert_problem(client.get(here), "not-found", 404)
    assert client.get(IDENTIFICATIONS).json() == {"identifications": [], "next": None}


def test_recordings_on_the_server_and_an_inline_robot(
    client: TestClient, settings: Settings, inline_robot: dict[str, Any], paper_recordings: tuple[bytes, bytes]
) -> None:
    client.post(RECORDINGS, files={"file": ("monday.csv", paper_recordings[0])})
    (settings.recordings_folder / "by-hand.csv").write_bytes(paper_recordings[1])
    body = {"robot": inline_robot, "recordings": ["monday.csv"], "held_out": ["by-hand.csv"], **QUICK}
    here = client.post(IDENTIFICATIONS, json=body).headers["location"]
    status = client.get(here).json()
    assert status["state"] == "succeeded", status
    assert status["recordings"][0]["origin"] == "server"
    assert client.get(f"{here}/result").json()["fit"]["held_out"]["relative_error"] > 0
    assert (settings.recordings_folder / "by-hand.csv").read_bytes() == paper_recordings[1]


def test_uploads_and_recordings_on_the_server_together(
    client: TestClient, files: Files, paper_recordings: tuple[bytes, bytes]
) -> None:
    client.post(RECORDINGS, files={"file": ("kept.csv", paper_recordings[1])})
    request = {"recordings": ["kept.csv", "train.csv"], **QUICK}
    status = client.get(client.post(IDENTIFICATIONS, files=files, data=form(request)).headers["location"]).json()
    assert status["state"] == "succeeded"
    assert [entry["origin"] for entry in status["recordings"]] == ["server", "uploaded"]


def test_the_request_part_may_be_sent_as_a_file(client: TestClient, files: Files) -> None:
    files.append(
        ("request", ("request.json", json.dumps({"options": {"estimator": "ls", "cutoff_hz": None}}).encode()))
    )
    status = client.post(IDENTIFICATIONS, files=files).json()
    assert status["options"]["estimator"] == "ls"


def test_a_waiting_identification_has_no_result_and_can_be_cancelled(
    waiting_client: TestClient, executor: ManualExecutor, files: Files
) -> None:
    running, waiting = (waiting_client.post(IDENTIFICATIONS, files=files).json() for _ in range(2))
    assert (running["state"], waiting["state"]) == ("running", "queued")
    for job in (running, waiting):
        here = job["links"]["self"]
        for below in ("result", "exports/json"):
            answer = waiting_client.get(f"{here}/{below}")
            assert_problem(answer, "not-finished", 409)
            assert answer.headers["retry-after"] == "2"
    full = waiting_client.post(IDENTIFICATIONS, files=files)
    assert_problem(full, "queue-full", 429)
    assert full.headers["retry-after"] == "10"

    for job in (waiting, running):
        cancelled = waiting_client.delete(job["links"]["self"])
        assert (cancelled.status_code, cancelled.json()["state"]) == (200, "cancelled")
        assert_problem(waiting_client.get(f"{job['links']['self']}/result"), "cancelled", 409)
    executor.run()
    assert waiting_client.get(running["links"]["self"]).json()["state"] == "cancelled"
    assert waiting_client.delete(running["links"]["self"]).status_code == 204


def test_the_step_of_a_running_identification_is_told(
    waiting_client: TestClient, settings: Settings, files: Files
) -> None:
    status = waiting_client.post(IDENTIFICATIONS, files=files).json()
    assert status["step"] is None
    (settings.data_folder / "identifications" / status["id"] / "progress").write_text(
        "estimate parameters", encoding="utf-8"
    )
    assert waiting_client.get(status["links"]["self"]).json()["step"] == "estimate parameters"


def test_a_broken_recording_fails_the_job_with_the_place(client: TestClient, files: Files) -> None:
    lines = files[1][1][1].decode().splitlines()
    lines[41] = lines[41].replace(lines[41].split(",")[4], "abc", 1)
    files[1] = ("recordings", ("broken.csv", "\n".join(lines).encode()))
    accepted = client.post(IDENTIFICATIONS, files=files)
    assert accepted.status_code == 202
    status = client.get(accepted.headers["location"]).json()
    assert status["state"] == "failed"
    problem = assert_problem(client.get(f"{status['links']['self']}/result"), "recording", 422)
    assert problem["detail"].startswith("broken.csv: line 42, column tau1: ")
    assert problem["detail"] == status["problem"]["detail"]
    assert_problem(client.get(f"{status['links']['self']}/exports/c"), "recording", 422)


def test_a_worker_that_dies(waiting_client: TestClient, executor: ManualExecutor, files: Files) -> None:
    here = waiting_client.post(IDENTIFICATIONS, files=files).headers["location"]
    for _ in range(MOST_ATTEMPTS):
        executor.fail(BrokenProcessPool("killed"))
    assert_problem(waiting_client.get(f"{here}/result"), "worker-lost", 500)


def test_after_a_restart_results_are_there_and_unfinished_work_is_done(
    settings: Settings, executor: ManualExecutor, files: Files
) -> None:
    with connected(create_app(settings, executor)) as client:
        done = client.post(IDENTIFICATIONS, files=files, data=form(QUICK)).headers["location"]
        executor.run()
        unfinished = client.post(IDENTIFICATIONS, files=files, data=form(QUICK)).headers["location"]
    with connected(create_app(settings, InlineExecutor())) as client:
        assert client.get(f"{done}/result").status_code == 200
        assert client.get(unfinished).json()["state"] == "succeeded"
        assert client.get(f"{unfinished}/result").json() == client.get(f"{done}/result").json()


@pytest.mark.parametrize("file", ["state.json", "order.json"])
def test_a_damaged_identification_is_shown_as_damaged(
    file: str, waiting_client: TestClient, settings: Settings, files: Files
) -> None:
    status = waiting_client.post(IDENTIFICATIONS, files=files).json()
    (settings.data_folder / "identifications" / status["id"] / file).write_bytes(b"\0\1\2")
    (listed,) = waiting_client.get(IDENTIFICATIONS).json()["identifications"]
    assert listed["state"] == "damaged"
    assert listed["problem"]["code"] == "damaged"
    assert waiting_client.get(listed["links"]["self"]).json() == listed


def test_a_damaged_result_is_a_problem_and_no_result(client: TestClient, settings: Settings, files: Files) -> None:
    status = client.post(IDENTIFICATIONS, files=files, data=form(QUICK)).json()
    folder: Path = settings.data_folder / "identifications" / status["id"]
    (folder / "result.json").write_bytes((folder / "result.json").read_bytes()[:100])
    (folder / "exports" / "friction.h").unlink()
    assert_problem(client.get(f"{status['links']['self']}/result"), "damaged", 409)
    assert_problem(client.get(f"{status['links']['self']}/exports/c"), "not-found", 404)


@pytest.mark.parametrize("identifier", ["nothing", "..", "%2e%2e%2f%2e%2e%2fetc", "20261103T101502Z-1f2e3d4c", "a%00b"])
def test_what_is_not_there(identifier: str, client: TestClient) -> None:
    here = f"{IDENTIFICATIONS}/{identifier}"
    for answer in (client.get(here), client.get(f"{here}/result"), client.get(f"{here}/exports/c")):
        assert_problem(answer, "not-found", 404)


def test_an_unknown_export(client: TestClient, files: Files) -> None:
    status = client.post(IDENTIFICATIONS, files=files, data=form(QUICK)).json()
    problem = assert_problem(client.get(f"{status['links']['self']}/exports/pyton"), "not-found", 404)
    assert "python" in problem["detail"]


def test_the_list_is_as_long_as_asked_for(waiting_client: TestClient, files: Files) -> None:
    for _ in range(2):
        waiting_client.post(IDENTIFICATIONS, files=files)
    assert len(waiting_client.get(IDENTIFICATIONS, params={"limit": 1}).json()["identifications"]) == 1
    for wrong in ("0", "1001", "x", "true"):
        problem = assert_problem(waiting_client.get(IDENTIFICATIONS, params={"limit": wrong}), "invalid-request", 422)
        assert problem["errors"][0]["field"] == "query.limit"
