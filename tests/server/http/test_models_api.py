"""Models over HTTP: judged as soon as an identification ends, chosen by hand, compared, and followed over time."""

from typing import Any

import pytest
from starlette.testclient import TestClient

from identified import NOON
from server.conftest import IDENTIFICATIONS, RECORDINGS, connected
from server.http.problem_check import assert_problem
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked
from tauscope.server.control.campaign import CampaignLinks, CampaignWorkspace
from tauscope.server.history.model_judgement import Candidate
from tauscope.server.http import Settings, create_app
from tauscope.server.http.services import Services
from tauscope.server.queue.job_folder import JobRecord, JobState

MODELS, ROBOT = "/api/v1/models", "paper-arm"


@pytest.fixture
def paper(client: TestClient, paper_robot: bytes, paper_recordings: tuple[bytes, bytes]) -> TestClient:
    """A service in which the paper's arm was identified: without, and then with a held-out recording."""
    for name, content in zip(("a.csv", "b.csv"), paper_recordings, strict=True):
        client.post(RECORDINGS, files={"file": (name, content)})
    for request in ('{"recordings": ["a.csv"]}', '{"recordings": ["a.csv"], "held_out": ["b.csv"]}'):
        answer = client.post(IDENTIFICATIONS, files={"robot": ("arm.yaml", paper_robot)}, data={"request": request})
        assert answer.status_code == 202, answer.text
    return client


def models(client: TestClient) -> list[dict[str, Any]]:
    answer = client.get(MODELS, params={"robot": ROBOT})
    assert answer.status_code == 200, answer.text
    return answer.json()["models"]


def test_from_an_identification_to_the_active_model(paper: TestClient) -> None:
    second, first = models(paper)
    assert (first["state"], second["state"]) == ("refused", "active")
    assert [gate["name"] for gate in first["gates"] if not gate["passed"]] == ["held_out"]
    assert all(gate["passed"] for gate in second["gates"])
    assert paper.get(second["links"]["self"]).json() == second
    result = paper.get(f"{IDENTIFICATIONS}/{second['id']}/result").json()
    assert paper.get(second["links"]["document"]).json() == result
    assert models(paper)[0]["state"] == "active"


def test_a_model_outlives_its_identification(paper: TestClient) -> None:
    _, first = models(paper)
    result = paper.get(f"{IDENTIFICATIONS}/{first['id']}/result").json()
    assert paper.delete(f"{IDENTIFICATIONS}/{first['id']}").status_code == 204
    assert paper.get(first["links"]["document"]).json() == result


def test_evidence_of_a_model_in_use_is_not_removed(paper: TestClient) -> None:
    second, first = models(paper)
    for path in (f"{IDENTIFICATIONS}/{second['id']}", f"{RECORDINGS}/a.csv", f"{RECORDINGS}/b.csv"):
        detail = assert_problem(paper.delete(path), "in-use", 409)["detail"]
        assert f"model {second['id']} is in use" in detail
        assert paper.get(path).status_code == 200
    for role in ("activate", "make-reference"):
        paper.post(f"{first['links']['self']}/{role}", json={"reason": "back to the one before"})
    assert paper.delete(f"{IDENTIFICATIONS}/{second['id']}").status_code == 204
    assert paper.delete(f"{RECORDINGS}/b.csv").status_code == 204
    assert_problem(paper.delete(f"{RECORDINGS}/a.csv"), "in-use", 409)


def test_a_robot_of_a_model_in_use_is_not_removed(paper: TestClient) -> None:
    active, _ = models(paper)
    robot = paper.get(f"{IDENTIFICATIONS}/{active['id']}/robot").json()
    (file,) = robot["files"]
    content = file["content"].encode()
    kept, other = (
        paper.post("/api/v1/robots", files={"robot": (file["name"], each)}).json()
        for each in (content, content + b"\n# another version\n")
    )
    detail = assert_problem(paper.delete(kept["link"]), "in-use", 409)["detail"]
    assert f"model {active['id']} is in use" in detail
    assert paper.delete(other["link"]).status_code == 204
    assert [each["version"] for each in paper.get("/api/v1/robots").json()["versions"]] == [kept["version"]]


def test_a_model_waits_for_its_campaign_and_is_judged_by_its_diagnosis(
    paper: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    services: Services = paper.app.state.services  # pyright: ignore[reportAttributeAccessIssue]
    keeper, identifier = services.models, models(paper)[0]["id"]
    diagnoses, campaigns = services.items["diagnosis"], services.campaigns.items
    content = b'{"schema": "tauscope.diagnosis/1", "verdict": "explained"}'
    folder = diagnoses.stage()
    (folder / "result.json").write_bytes(content)
    made = CampaignLinks(identification=identifier, diagnosis=diagnoses.publish(folder))
    folder, record = campaigns.stage(), JobRecord(state=JobState.RUNNING, created=NOON)
    CampaignWorkspace(folder).record_made(**dict(made))
    CampaignWorkspace(folder).write_record(record)
    campaign = CampaignWorkspace(campaigns.folder(campaigns.publish(folder)))
    judged: list[Candidate] = []
    monkeypatch.setattr(keeper.history, "list_unjudged", lambda _site: [identifier])
    monkeypatch.setattr(keeper.history, "consider", lambda candidate, _now: judged.append(candidate) or entry)
    entry = keeper.history.find(identifier)
    assert keeper.judge_new() == judged == []
    campaign.write_record(record.moved(JobState.SUCCEEDED, NOON))
    assert keeper.judge_new() == [entry]
    assert [each.diagnosis for each in judged] == [content]


def test_a_choice_by_hand_with_its_reason(paper: TestClient) -> None:
    second, first = models(paper)
    answer = paper.post(f"{first['links']['self']}/activate", json={"reason": "no second recording here"})
    assert (answer.status_code, answer.json()["state"]) == (200, "active")
    assert answer.json()["links"] == first["links"]
    assert [model["state"] for model in models(paper)] == ["kept", "active"]
    answer = paper.post(f"{first['links']['self']}/make-reference", json={"reason": "new gear"})
    assert answer.json()["is_reference"] is True
    drift = paper.get(f"{second['links']['self']}/drift").json()
    assert (drift["before"], drift["after"]) == (first["id"], second["id"])
    assert {each["in_std"] for each in drift["parameters"]} == {0.0}  # the same recording: the same estimate
    assert set(drift["joints"]) == {"joint1", "joint2", "joint3"}
    trend = paper.get("/api/v1/trend", params={"robot": ROBOT}).json()
    assert {len(each["points"]) for each in trend["parameters"]} == {2}
    assert {each["line"] for each in trend["parameters"]} == {None}


def test_bounds_are_set_for_a_robot(paper: TestClient) -> None:
    models(paper)
    where = "/api/v1/model-policy"
    answer = paper.put(where, params={"robot": ROBOT}, json={"drift_share": 0.1})
    assert answer.status_code == 200, answer.text
    assert paper.get(where, params={"robot": ROBOT}).json() == answer.json()
    assert answer.json()["drift_share"] == 0.1
    assert paper.get("/api/v1/events", params={"robot": ROBOT, "open": True}).json() == {"events": []}


def test_an_old_data_folder_gets_its_history(tmp_path: Any) -> None:
    settings = Settings(data_folder=unpacked(SNAPSHOTS[-1], tmp_path))
    for _ in range(2):
        with connected(create_app(settings, InlineExecutor())) as client:
            found = client.get(MODELS, params={"robot": "snapshot-arm"}).json()["models"]
        # The campaign moved a simulated arm: it does not replace what was measured elsewhere.
        assert [(model["state"], model["source"]) for model in found] == [
            ("refused", "simulated"),
            ("active", "uploaded"),
        ]


def test_an_order_that_names_an_unknown_robot_holds_up_no_service(
    paper: TestClient, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One flipped bit of a name, in an identification that was not judged yet when the service was killed."""
    services = paper.app.state.services  # pyright: ignore[reportAttributeAccessIssue]
    keeper, damaged = services.models, models(paper)[0]["id"]
    order = services.items["identification"].folder(damaged) / "order.json"
    order.write_text(order.read_text().replace(f'"{ROBOT}"', '"paper-aro"'))
    monkeypatch.setattr(keeper.history, "list_unjudged", lambda _site: [damaged])
    assert keeper.judge_new() == keeper.judge_new() == []
    (told,) = [each.getMessage() for each in caplog.records if each.levelname == "WARNING"]
    assert damaged in told
    assert "paper-aro" in told


@pytest.mark.parametrize("path", [f"{MODELS}/x", f"{MODELS}/x/document", f"{MODELS}/x/drift", "/api/v1/trend?robot=x"])
def test_what_is_not_there(path: str, module_client: TestClient) -> None:
    assert_problem(module_client.get(path), "not-found", 404)


@pytest.mark.parametrize("path", [f"{MODELS}/x/activate", f"{MODELS}/x/make-reference", "/api/v1/events/1/acknowledge"])
def test_decisions_need_a_reason_and_something_to_decide(path: str, module_client: TestClient) -> None:
    assert_problem(module_client.post(path, json={"reason": "so"}), "not-found", 404)
    assert_problem(module_client.post(path, json={}), "invalid-request", 422)
    assert_problem(module_client.post(path, json={"reason": ""}), "invalid-request", 422)
    assert_problem(module_client.post(path, content=b"reason"), "media-type", 415)
    assert_problem(module_client.put("/api/v1/model-policy?robot=x", json={"drift_std": -1.0}), "invalid-request", 422)
