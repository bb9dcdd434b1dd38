"""Campaigns over HTTP: begun, followed, stopped, their result fetched with everything that led to it."""

from collections.abc import Iterator
from typing import Any

import pytest
from ruamel.yaml import YAML
from starlette.testclient import TestClient

from server.conftest import connected
from server.http.event_stream import read_events
from server.http.motions import ROBOT
from server.http.problem_check import assert_problem
from server.queue.controls import HandControls
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.waiting import wait_until
from tauscope.runtime.record import RunProblem
from tauscope.runtime.states import RunState
from tauscope.server.control.campaign import CampaignWorkspace
from tauscope.server.http import Settings, create_app
from tauscope.server.queue.analyses import ExcitationWorkspace

CAMPAIGNS, RUNS = "/api/v1/campaigns", "/api/v1/runs"
QUICK = {"duration_s": 4.0, "harmonics": 2, "periods": 2, "starts": 1, "slow_postures": 0, "closing_period": False}


@pytest.fixture
def controls() -> HandControls:
    return HandControls()


@pytest.fixture
def arm(settings: Settings, controls: HandControls) -> Iterator[TestClient]:
    """Jobs are done at once, runs go on as the test says."""
    with connected(create_app(settings, InlineExecutor(), controls)) as client:
        yield client
        controls.obey_from_now_on()


@pytest.fixture
def waiting_arm(settings: Settings, controls: HandControls, executor: ManualExecutor) -> Iterator[TestClient]:
    """Jobs are done when the test says so."""
    with connected(create_app(settings, executor, controls)) as client:
        yield client
        controls.obey_from_now_on()


def ended(client: TestClient, campaign: dict[str, Any]) -> dict[str, Any]:
    here = campaign["links"]["self"]
    wait_until(lambda: client.get(here).json()["state"] not in ("queued", "running"))
    return client.get(here).json()


def test_a_simulated_arm_without_a_model_is_refused_before_its_motion_is_designed(waiting_arm: TestClient) -> None:
    robot = {key: value for key, value in ROBOT.items() if key != "model"}
    for path in (CAMPAIGNS, RUNS):
        answer = waiting_arm.post(path, json={"robot": robot, "backend": {"name": "sim"}})
        assert "all 2 links; state model.links" in assert_problem(answer, "robot-file", 422)["detail"]
    for path in ("campaigns", "runs", "excitations"):
        assert waiting_arm.get(f"/api/v1/{path}").json()[path] == []


def test_a_campaign_all_the_way(
    arm: TestClient, controls: HandControls, paper_robot: bytes, paper_recordings: tuple[bytes, bytes]
) -> None:
    body = {
        "robot": YAML(typ="safe").load(paper_robot),
        "excitation": QUICK,
        "identification": {"cutoff_hz": None},
        "backend": {"name": "sim", "scenario": {"torque_noise_std": [0.5, 0.3, 0.7]}},
    }
    answer = arm.post(CAMPAIGNS, json=body)
    assert answer.status_code == 202, answer.text
    campaign = answer.json()
    assert answer.headers["location"] == campaign["links"]["self"]
    assert_problem(arm.get(f"{campaign['links']['self']}/result"), "not-finished", 409)
    for number, recording in enumerate(paper_recordings, start=1):
        controls.next(number).finish(csv=recording.decode())
    status = ended(arm, campaign)
    assert status["state"] == "succeeded", status["problem"]
    assert [(step["name"], step["state"]) for step in status["steps"]] == [
        ("design", "succeeded"),
        ("held-out design", "succeeded"),
        ("run", "finished"),
        ("held-out run", "finished"),
        ("identify", "succeeded"),
    ]
    for step in status["steps"]:
        assert arm.get(step["link"]).status_code == 200
    for link in (*status["links"]["recordings"], *status["links"]["held_out"], status["links"]["identification"]):
        assert arm.get(link).status_code == 200
    result = arm.get(status["links"]["result"]).json()
    assert result["schema"] == "tauscope.campaign/1"
    assert result["identification"] == arm.get(f"{status['links']['identification']}/result").json()
    assert result["identification"]["fit"]["held_out"] is not None
    assert (result["links"], result["steps"]) == (status["links"], status["steps"])
    assert arm.get(f"{RUNS}/{status['steps'][2]['link'].rsplit('/', 1)[1]}").json()["campaign"] == campaign["id"]
    told = list(read_events(arm.get(status["links"]["events"]).text.split("\n")))
    assert [event.data["step"] for event in told if event.kind == "step"][-1] == "identify"
    assert [entry["id"] for entry in arm.get(CAMPAIGNS).json()["campaigns"]] == [campaign["id"]]

    identification = status["links"]["identification"]
    assert_problem(arm.delete(identification), "in-use", 409)  # it has become the active model
    services = arm.app.state.services  # pyright: ignore[reportAttributeAccessIssue]
    services.jobs.cancel_or_remove(services.kinds["identification"], identification.rsplit("/", 1)[1])
    assert arm.get(campaign["links"]["self"]).json()["steps"][-1]["state"] == "gone"
    assert_problem(arm.get(status["links"]["result"]), "not-found", 404)
    wait_until(lambda: arm.delete(campaign["links"]["self"]).status_code == 204)
    assert arm.get(CAMPAIGNS).json() == {"campaigns": [], "next": None}


def test_stop_at_once_and_again(waiting_arm: TestClient) -> None:
    campaign = waiting_arm.post(CAMPAIGNS, json={"robot": ROBOT}).json()
    wait_until(lambda: waiting_arm.get(campaign["links"]["self"]).json()["steps"][0]["state"] == "running")
    answer = waiting_arm.post(campaign["links"]["stop"])
    assert (answer.status_code, answer.json()["id"]) == (202, campaign["id"])
    status = ended(waiting_arm, campaign)
    assert status["state"] == "cancelled"
    assert status["steps"][0]["state"] == "cancelled"
    answer = waiting_arm.post(campaign["links"]["stop"])
    assert (answer.status_code, answer.json()["state"]) == (202, "cancelled")
    assert_problem(waiting_arm.get(f"{campaign['links']['self']}/result"), "cancelled", 409)


def test_an_arm_has_one_campaign_or_one_run_at_a_time(waiting_arm: TestClient) -> None:
    campaign = waiting_arm.post(CAMPAIGNS, json={"robot": ROBOT}).json()
    for path in (CAMPAIGNS, RUNS):
        problem = assert_problem(waiting_arm.post(path, json={"robot": ROBOT}), "busy", 409)
        assert f"campaign {campaign['id']} has it" in problem["detail"]
    assert_problem(waiting_arm.delete(campaign["links"]["self"]), "not-finished", 409)
    waiting_arm.post(campaign["links"]["stop"])
    ended(waiting_arm, campaign)


def test_a_run_that_fails_ends_the_campaign_with_its_problem(
    waiting_arm: TestClient, controls: HandControls, executor: ManualExecutor, settings: Settings
) -> None:
    campaign = waiting_arm.post(CAMPAIGNS, json={"robot": ROBOT, "held_out": None}).json()
    wait_until(lambda: bool(executor.tasks))
    made = CampaignWorkspace(settings.data_folder / "campaigns" / campaign["id"]).read_made
    wait_until(lambda: made().excitation is not None)
    ExcitationWorkspace(settings.data_folder / "excitations" / str(made().excitation)).trajectory.touch()
    future, _ = executor.tasks.pop(0)
    future.set_result(None)
    controls.next().finish(RunState.FAILED, RunProblem(code="acquisition", detail="joint1: too fast"), csv="")
    status = ended(waiting_arm, campaign)
    assert (status["state"], status["problem"]["code"]) == ("failed", "acquisition")
    problem = assert_problem(waiting_arm.get(f"{campaign['links']['self']}/result"), "acquisition", 409)
    assert problem["detail"].endswith("joint1: too fast")


@pytest.mark.parametrize(
    ("body", "code", "words"),
    [
        ({}, "invalid-request", "no robot"),
        ({"robot": ROBOT, "held_out": {"seed": -1}}, "invalid-request", "body.held_out.seed"),
        ({"robot": ROBOT, "run": {"rate_hz": -1}}, "invalid-request", "body.run.rate_hz"),
        ({"robot": ROBOT, "excitation": {"harmonic": 5}}, "invalid-request", "body.excitation.harmonic"),
        ({"robot": ROBOT, "identification": {"estimator": "ridge"}}, "invalid-request", "body.identification"),
        ({"robot": {}}, "robot-file", "robot: "),
    ],
)
def test_requests_that_are_refused(
    body: dict[str, Any], code: str, words: str, arm: TestClient, settings: Settings
) -> None:
    problem = assert_problem(arm.post(CAMPAIGNS, json=body), code, 422)
    assert words in problem["detail"] + str(problem.get("errors"))
    assert list((settings.data_folder / "campaigns").iterdir()) == []


def test_a_scenario_that_is_no_plain_data(arm: TestClient) -> None:
    text = '{"robot": {"name": "r"}, "backend": {"scenario": {"seed": NaN}}}'
    answer = arm.post(CAMPAIGNS, content=text, headers={"content-type": "application/json"})
    assert answer.status_code == 422


@pytest.mark.parametrize("file", ["state.json", "order.json"])
def test_a_damaged_campaign_is_shown_as_damaged(file: str, waiting_arm: TestClient, settings: Settings) -> None:
    campaign = waiting_arm.post(CAMPAIGNS, json={"robot": ROBOT}).json()
    waiting_arm.post(campaign["links"]["stop"])
    ended(waiting_arm, campaign)
    (settings.data_folder / "campaigns" / campaign["id"] / file).write_bytes(b"\0")
    (listed,) = waiting_arm.get(CAMPAIGNS).json()["campaigns"]
    assert listed["state"] == "damaged"


def test_what_is_not_there(arm: TestClient) -> None:
    for below in ("", "/result", "/events"):
        assert_problem(arm.get(f"{CAMPAIGNS}/nothing{below}"), "not-found", 404)
    assert_problem(arm.post(f"{CAMPAIGNS}/nothing/stop"), "not-found", 404)
    assert_problem(arm.delete(f"{CAMPAIGNS}/nothing"), "not-found", 404)
