"""Diagnoses over HTTP: handed in, followed, result, figures and model fetched, removed."""

import json
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from diagnosis.diagnosed_arm import only_effects
from server.conftest import RECORDINGS
from server.http.problem_check import assert_problem
from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.plots import DiagnosisPlots
from tauscope.export.model_file import ModelFile
from tauscope.robot import read_robot
from tauscope.trajectory import parse_trajectory_json
from tauscope_sim.examples import example_robot
from tauscope_sim.scenario_file import read_scenario

DIAGNOSES = "/api/v1/diagnoses"

Files = list[tuple[str, tuple[str, bytes]]]


@pytest.fixture
def files(paper_robot: bytes, paper_recordings: tuple[bytes, bytes]) -> Files:
    return [
        ("robot", ("arm.yaml", paper_robot)),
        ("recordings", ("train.csv", paper_recordings[0])),
        ("held_out", ("test.csv", paper_recordings[1])),
    ]


def form(request: dict[str, Any]) -> dict[str, str]:
    return {"request": json.dumps(request)}


@pytest.mark.slow
@pytest.mark.usefixtures("drawn_figures")
def test_uploaded_files_all_the_way(client: TestClient, files: Files, tmp_path: Path) -> None:
    accepted = client.post(DIAGNOSES, files=files, data=form({"options": {"next_trajectory": True}}))
    assert accepted.status_code == 202
    here = accepted.headers["location"]
    status = client.get(here).json()
    assert status["state"] == "succeeded", status
    assert status["options"]["against"] == "identified"
    assert [(entry["name"], entry["origin"]) for entry in status["held_out"]] == [("test.csv", "uploaded")]

    found = DiagnosisDocument.model_validate_json(client.get(status["links"]["result"]).content)
    assert found.robot == "paper-arm"
    assert found.next_experiment is not None
    plots = DiagnosisPlots.model_validate_json(client.get(status["links"]["plots"]).content)
    assert {curve.joint for curve in plots.curves} == set(found.joints)
    assert all(len(each.edges) == len(each.before) + 1 for each in plots.histograms)
    model = ModelFile.model_validate_json(client.get(status["links"]["model"]).content)
    assert len(model.friction) == 3
    text = client.get(status["links"]["next_trajectory"]).text
    planned = parse_trajectory_json(text, "planned", read_robot(example_robot("paper_arm")))
    assert planned.duration_s > 5.0

    links = status["links"]
    arm, scenario = tmp_path / "arm.yaml", tmp_path / "scenario.yaml"
    arm.write_bytes(client.get(links["improved_robot"]).content)
    scenario.write_bytes(client.get(links["scenario"]).content)
    read_scenario(scenario, read_robot(arm))
    assert set(links["exports"]) == {"c", "python"}
    compile(client.get(links["exports"]["python"]).content, "compensation.py", "exec")
    assert_problem(client.get(f"{here}/exports/urdf"), "not-found", 404)

    steps = [line for line in client.get(status["links"]["events"]).text.splitlines() if "compare effects" in line]
    assert steps
    assert [entry["id"] for entry in client.get(DIAGNOSES).json()["diagnoses"]] == [status["id"]]

    saved = ("model", ("model.json", client.get(links["model"]).content))
    for more, fields in (
        ([saved], {}),
        ([], {"model": status["id"]}),
        ([], {"model": model.model_dump(by_alias=True)}),
    ):
        request = form({"options": {"against": "saved"}, **fields})
        again = client.get(client.post(DIAGNOSES, files=[*files, *more], data=request).headers["location"]).json()
        assert again["state"] == "succeeded", again
        assert client.get(again["links"]["result"]).json()["verdict"] == found.verdict

    assert client.delete(here).status_code == 204
    assert_problem(client.get(here), "not-found", 404)


def test_a_saved_model_and_what_is_compared_with_belong_together(client: TestClient, files: Files) -> None:
    answer = client.post(DIAGNOSES, files=files, data=form({"options": {"against": "saved"}}))
    assert "model" in assert_problem(answer, "invalid-request", 422)["detail"]
    saved = ("model", ("model.json", b"{}"))
    assert_problem(client.post(DIAGNOSES, files=[*files, saved], data=form({})), "invalid-request", 422)
    request = form({"options": {"against": "saved"}, "model": "20261103T101502Z-1f2e3d4c"})
    assert_problem(client.post(DIAGNOSES, files=files, data=request), "not-found", 404)
    request = form({"options": {"against": "saved"}})
    refused = client.get(client.post(DIAGNOSES, files=[*files, saved], data=request).headers["location"]).json()
    assert refused["problem"]["code"] == "identification"
    assert refused["problem"]["detail"].startswith("model.json: ")


@pytest.mark.slow
def test_against_the_model_of_the_robot_file(client: TestClient, files: Files) -> None:
    with only_effects(["payload"]):
        accepted = client.post(DIAGNOSES, files=files, data=form({"options": {"against": "model"}}))
    status = client.get(accepted.headers["location"]).json()
    found = DiagnosisDocument.model_validate_json(client.get(status["links"]["result"]).content)
    assert found.against == "model"


def test_a_simulator_needs_recordings_and_recordings_a_simulator(client: TestClient, files: Files) -> None:
    answer = client.post(DIAGNOSES, files=files, data=form({"options": {"against": "simulation"}}))
    assert "simulator" in assert_problem(answer, "invalid-request", 422)["detail"]
    more = [*files, ("simulated", ("sim.csv", files[1][1][1] + b"\n"))]
    assert_problem(client.post(DIAGNOSES, files=more, data=form({})), "invalid-request", 422)


def test_a_recording_that_is_nowhere_is_named(client: TestClient, files: Files) -> None:
    answer = client.post(DIAGNOSES, files=files[:1], data=form({"recordings": ["nowhere.csv"]}))
    assert "nowhere.csv" in assert_problem(answer, "not-found", 404)["detail"]
    assert client.get(RECORDINGS).status_code == 200
