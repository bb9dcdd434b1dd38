"""Excitations over HTTP: handed in, followed, fetched as documents and as trajectories."""

import json
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.http.event_stream import read_events
from server.http.motions import QUICK_DESIGN, ROBOT, ROBOT_FILE, move_document
from server.http.problem_check import assert_problem
from server.queue.executors import ManualExecutor
from tauscope.robot import read_robot
from tauscope.server.http import Settings
from tauscope.server.queue.analyses import ExcitationWorkspace
from tauscope.trajectory import parse_trajectory_json

EXCITATIONS = "/api/v1/excitations"


def test_a_design_all_the_way(client: TestClient, settings: Settings) -> None:
    accepted = client.post(EXCITATIONS, json={"robot": ROBOT, "options": {**QUICK_DESIGN, "floor_m": -0.4, "seed": 5}})
    assert accepted.status_code == 202, accepted.text
    here = accepted.headers["location"]
    status = client.get(here).json()
    assert status["state"] == "succeeded", status["problem"]
    assert (status["robot"], status["options"]["seed"], status["options"]["floor_m"]) == ("two-joint-arm", 5, -0.4)
    result = client.get(status["links"]["result"])
    assert result.headers["content-type"] == "application/json"
    assert result.json()["schema"] == "tauscope.excitation/1"

    workspace = ExcitationWorkspace(settings.data_folder / "excitations" / status["id"])
    robot = read_robot(workspace.robot / "robot.json")
    exact = client.get(status["links"]["trajectory"])
    trajectory = parse_trajectory_json(exact.content, "it", robot)
    assert trajectory.period_s == 4.0
    assert trajectory.duration_s >= 8.0
    csv = client.get(status["links"]["trajectory"], params={"format": "csv", "rate_hz": 50})
    assert csv.headers["content-disposition"] == 'attachment; filename="trajectory.csv"'
    header, *rows = [line for line in csv.text.splitlines() if not line.startswith("#")]
    assert header.split(",")[:3] == ["t", "q1", "q2"]
    assert len(rows) == pytest.approx(50 * trajectory.duration_s, abs=2)

    told = list(read_events(client.get(status["links"]["events"]).text.split("\n")))
    progress = [event.data for event in told if event.kind == "progress"]
    percents = [data["percent"] for data in progress]
    assert len(percents) > 3
    assert percents == sorted(percents)
    assert {"step", "cost", "best_cost"} == set(progress[0]["figures"])
    assert told[-1].data["state"] == "succeeded"
    assert client.delete(here).status_code == 204
    assert client.get(EXCITATIONS).json() == {"excitations": [], "next": None}


def test_limits_that_leave_no_motion(client: TestClient) -> None:
    status = client.post(EXCITATIONS, json={"robot": ROBOT, "options": {**QUICK_DESIGN, "floor_m": 5.0}}).json()
    status = client.get(status["links"]["self"]).json()
    assert (status["state"], status["problem"]["code"]) == ("failed", "excitation")
    assert_problem(client.get(f"{status['links']['self']}/result"), "excitation", 422)
    assert_problem(client.get(f"{status['links']['self']}/trajectory"), "excitation", 422)


def test_a_box_that_is_none(client: TestClient) -> None:
    box = {"low": [1.0, 0.0, 0.0], "high": [0.0, 1.0, 1.0]}
    status = client.post(EXCITATIONS, json={"robot": ROBOT, "options": {**QUICK_DESIGN, "boxes": [box]}}).json()
    problem = client.get(status["links"]["self"]).json()["problem"]
    assert problem["code"] == "excitation"
    assert "box" in problem["detail"]


def designed(client: TestClient, executor: ManualExecutor, settings: Settings) -> str:
    """A design that ended with a motion that the test knows."""
    answer = client.post(EXCITATIONS, files={"robot": ("arm.yaml", ROBOT_FILE)}).json()
    workspace = ExcitationWorkspace(settings.data_folder / "excitations" / answer["id"])
    workspace.trajectory.write_text(json.dumps(move_document()), encoding="utf-8")
    future, _ = executor.tasks.pop(0)
    future.set_running_or_notify_cancel()
    future.set_result(None)
    return answer["links"]["self"]


def test_a_design_that_waits_is_cancelled(waiting_client: TestClient, executor: ManualExecutor) -> None:
    here = waiting_client.post(EXCITATIONS, json={"robot": ROBOT}).headers["location"]
    for below in ("result", "trajectory"):
        assert_problem(waiting_client.get(f"{here}/{below}"), "not-finished", 409)
    assert waiting_client.delete(here).json()["state"] == "cancelled"
    executor.run()
    assert_problem(waiting_client.get(f"{here}/trajectory"), "cancelled", 409)


@pytest.mark.parametrize(
    ("query", "code", "status"),
    [
        ("format=xml", "invalid-request", 422),
        ("rate_hz=0", "invalid-request", 422),
        ("rate_hz=nan", "invalid-request", 422),
        ("format=csv&rate_hz=1e9", "invalid-request", 422),
    ],
)
def test_trajectories_that_are_not_made(
    query: str, code: str, status: int, waiting_client: TestClient, executor: ManualExecutor, settings: Settings
) -> None:
    here = designed(waiting_client, executor, settings)
    assert_problem(waiting_client.get(f"{here}/trajectory?{query}"), code, status)


def test_a_table_that_would_be_too_long(
    waiting_client: TestClient, executor: ManualExecutor, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tauscope.server.queue.analyses.MOST_ROWS", 1000)
    here = designed(waiting_client, executor, settings)
    assert waiting_client.get(f"{here}/trajectory?format=csv&rate_hz=900").status_code == 200
    assert_problem(waiting_client.get(f"{here}/trajectory?format=csv&rate_hz=1100"), "limit-exceeded", 413)


def test_files_that_are_damaged(waiting_client: TestClient, executor: ManualExecutor, settings: Settings) -> None:
    here = designed(waiting_client, executor, settings)
    workspace = ExcitationWorkspace(settings.data_folder / "excitations" / here.rsplit("/", 1)[1])
    assert_problem(waiting_client.get(f"{here}/result"), "damaged", 409)
    workspace.trajectory.write_bytes(b"\0")
    assert_problem(waiting_client.get(f"{here}/trajectory?format=csv"), "excitation", 422)
    workspace.trajectory.unlink()
    assert_problem(waiting_client.get(f"{here}/trajectory"), "damaged", 409)
    (workspace.folder / "order.json").write_bytes(b"")
    assert waiting_client.get(here).json()["state"] == "damaged"


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"duration_s": 0}, "body.options.duration_s"),
        ({"duration_s": "10"}, "body.options.duration_s"),
        ({"harmonics": 1}, "body.options.harmonics"),
        ({"harmonics": 2.5}, "body.options.harmonics"),
        ({"periods": 0}, "body.options.periods"),
        ({"seed": -1}, "body.options.seed"),
        ({"criterion": "best"}, "body.options.criterion"),
        ({"boxes": [{"low": [0, 0], "high": [1, 1, 1]}]}, "body.options.boxes.0.low"),
        ({"floor": 0.0}, "body.options.floor"),
    ],
)
def test_wishes_that_mean_nothing(options: dict[str, Any], field: str, module_client: TestClient) -> None:
    answer = module_client.post(EXCITATIONS, json={"robot": ROBOT, "options": options})
    problem = assert_problem(answer, "invalid-request", 422)
    assert any(error["field"].startswith(field) for error in problem["errors"])


def test_what_is_not_there(module_client: TestClient) -> None:
    for below in ("", "/result", "/trajectory", "/events"):
        assert_problem(module_client.get(f"{EXCITATIONS}/nothing{below}"), "not-found", 404)
