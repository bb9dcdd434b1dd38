"""Rollouts over HTTP: handed in with the model of an identification, followed, result and report fetched, removed."""

import json
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS
from server.http.problem_check import assert_problem
from tauscope.closed_loop import RolloutDocument
from tauscope.export.model_file import ModelFile

ROLLOUTS = "/api/v1/rollouts"

Files = list[tuple[str, tuple[str, bytes]]]


@pytest.fixture
def robot(paper_robot: bytes) -> Files:
    return [("robot", ("arm.yaml", paper_robot))]


@pytest.fixture
def judge(paper_recordings: tuple[bytes, bytes]) -> Files:
    """The first two seconds: MuJoCo takes a step a millisecond."""
    lines = paper_recordings[1].splitlines(keepends=True)
    begun = [line for line in lines if not line[:1].isdigit() or float(line.split(b",")[0]) < 2.0]
    return [("recordings", ("judge.csv", b"".join(begun)))]


def form(request: dict[str, Any]) -> dict[str, str]:
    return {"request": json.dumps(request)}


def follow(client: TestClient, files: Files, request: dict[str, Any]) -> dict[str, Any]:
    """The state of a rollout that has ended."""
    accepted = client.post(ROLLOUTS, files=files, data=form(request))
    assert accepted.status_code == 202, accepted.text
    return client.get(accepted.headers["location"]).json()


@pytest.fixture
def identification(client: TestClient, robot: Files, paper_recordings: tuple[bytes, bytes]) -> dict[str, Any]:
    train = ("recordings", ("train.csv", paper_recordings[0]))
    status = client.get(client.post(IDENTIFICATIONS, files=[*robot, train]).headers["location"]).json()
    assert status["state"] == "succeeded", status
    return status


def test_the_model_of_an_identification_is_rolled_out(
    client: TestClient, robot: Files, judge: Files, identification: dict[str, Any]
) -> None:
    status = follow(client, [*robot, *judge], {"model": identification["id"]})
    assert status["state"] == "succeeded", status
    assert [(entry["name"], entry["origin"]) for entry in status["recordings"]] == [("judge.csv", "uploaded")]
    found = RolloutDocument.model_validate_json(client.get(status["links"]["result"]).content)
    assert found.robot == "paper-arm"
    assert found.drive == "torque"  # this arm states no loop
    assert "identified" in [entry.model for entry in found.summary]
    assert b"Position error" in client.get(status["links"]["report"]).content
    assert client.get("/api/v1/items", params={"kind": "rollout"}).json()["items"][0]["id"] == status["id"]
    assert [entry["id"] for entry in client.get(ROLLOUTS).json()["rollouts"]] == [status["id"]]

    content = client.get(identification["links"]["model"]).content
    model = ModelFile.model_validate_json(content)
    for more, fields in (
        ([("model", ("model.json", content))], {}),
        ([], {"model": model.model_dump(mode="json", by_alias=True)}),
    ):
        again = follow(client, [*robot, *judge, *more], fields)
        assert again["state"] == "succeeded", again
        same = RolloutDocument.model_validate_json(client.get(again["links"]["result"]).content)
        assert same.summary == found.summary

    assert client.delete(status["links"]["self"]).status_code == 204
    assert_problem(client.get(status["links"]["self"]), "not-found", 404)


def test_a_refinement_needs_commands_and_never_judges_itself(
    client: TestClient,
    robot: Files,
    judge: Files,
    paper_recordings: tuple[bytes, bytes],
    identification: dict[str, Any],
) -> None:
    train = ("refine", ("train.csv", paper_recordings[0]))
    ended = follow(client, [*robot, *judge, train], {"model": identification["id"]})
    assert [entry["name"] for entry in ended["refine"]] == ["train.csv"]
    assert ended["problem"]["code"] == "recording-mismatch"
    assert "a refinement needs commands" in ended["problem"]["detail"]
    same = ("refine", ("train.csv", judge[0][1][1]))
    answer = client.post(ROLLOUTS, files=[*robot, *judge, same], data=form({"model": identification["id"]}))
    assert "never judges itself" in assert_problem(answer, "invalid-request", 422)["detail"]


def test_a_model_comes_once_and_is_there(client: TestClient, robot: Files, judge: Files) -> None:
    saved = ("model", ("model.json", b"{}"))
    nowhere = form({"model": "20261103T101502Z-1f2e3d4c"})
    answer = client.post(ROLLOUTS, files=[*robot, *judge, saved], data=nowhere)
    assert "twice" in assert_problem(answer, "invalid-request", 422)["detail"]
    assert_problem(client.post(ROLLOUTS, files=[*robot, *judge], data=nowhere), "not-found", 404)
    ended = follow(client, [*robot, *judge, saved], {})
    assert ended["problem"]["detail"].startswith("model.json: ")


def test_without_a_model_that_of_the_robot_file_is_judged(client: TestClient, robot: Files, judge: Files) -> None:
    ended = follow(client, [*robot, *judge], {})
    assert [each["model"] for each in client.get(ended["links"]["result"]).json()["summary"]] == ["stated"]
