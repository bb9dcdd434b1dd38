"""The seed paper end to end through REST: one request designs, runs and identifies the arm of its Table 1."""

import json
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest
from ruamel.yaml import YAML

from server.conftest import IDENTIFICATIONS
from server.http.event_stream import read_events
from server.http.serving import served
from server.queue.paper_files import PAPER_ROBOT
from tauscope.robot import read_robot
from tauscope.robot.robot import STANDARD_PARAMETERS

NOISE_STD = [0.5, 0.3, 0.7]
CAMPAIGNS, RUNS = "/api/v1/campaigns", "/api/v1/runs"

pytestmark = [pytest.mark.proof, pytest.mark.timeout(1200)]


def until_it_ends(client: httpx2.Client, events: str) -> dict[str, Any]:
    """The end event, by way of the stream."""
    with client.stream("GET", events, timeout=300) as answer:
        (*_, last) = read_events(answer.iter_lines())
    assert last.kind == "ended"
    return last.data


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx2.Client]:
    with served(tmp_path_factory.mktemp("paper-campaign") / "data") as service:
        yield service.client


@pytest.fixture(scope="module")
def campaign(client: httpx2.Client) -> dict[str, Any]:
    """One request; everything else is its default."""
    robot = YAML(typ="safe").load(PAPER_ROBOT)
    backend = {"name": "sim", "time": "virtual", "scenario": {"torque_noise_std": NOISE_STD, "seed": 1}}
    answer = client.post(CAMPAIGNS, json={"robot": robot, "backend": backend})
    assert answer.status_code == 202, answer.text
    end = until_it_ends(client, answer.json()["links"]["events"])
    assert end["state"] == "succeeded", end
    return client.get(answer.json()["links"]["self"]).json()


@pytest.fixture(scope="module")
def result(client: httpx2.Client, campaign: dict[str, Any]) -> dict[str, Any]:
    return client.get(campaign["links"]["result"]).json()["identification"]


def identified(client: httpx2.Client, campaign: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """Another identification from the same recording."""
    robot = YAML(typ="safe").load(PAPER_ROBOT)
    body = {"robot": robot, "recordings": [link.rsplit("/", 1)[1] for link in campaign["links"]["recordings"]]}
    answer = client.post(IDENTIFICATIONS, json={**body, **changes})
    assert answer.status_code == 202, answer.text
    job = answer.json()
    assert until_it_ends(client, job["links"]["events"])["state"] == "succeeded"
    return client.get(f"{job['links']['self']}/result").json()


def stds(result: dict[str, Any]) -> dict[str, float]:
    """Standard errors of the 24 parameters."""
    base = {entry["name"]: entry["std"] for entry in result["base_parameters"]}
    names = ("stiction", "stribeck", "viscous")
    return base | {f"{name} {entry['joint']}": entry["std"][name] for entry in result["friction"] for name in names}


def test_all_24_parameters_are_within_four_standard_errors(result: dict[str, Any]) -> None:
    arm = read_robot(PAPER_ROBOT)
    truth = {
        f"{name}{number}": value
        for number, link in enumerate(arm.model.links or (), start=1)
        for name, value in zip(STANDARD_PARAMETERS, link.to_vector(), strict=True)
    }
    errors = {
        entry["name"]: (entry["value"] - sum(factor * truth[name] for name, factor in entry["terms"].items()))
        / entry["std"]
        for entry in result["base_parameters"]
    }
    for entry, friction in zip(result["friction"], arm.model.friction or (), strict=True):
        for name in ("stiction", "stribeck", "viscous"):
            errors[f"{name} {entry['joint']}"] = (entry[name] - getattr(friction, name)) / entry["std"][name]
    print(json.dumps({name: round(error, 2) for name, error in errors.items()}))
    assert len(errors) == 24
    assert max(abs(error) for error in errors.values()) < 4.0, errors


def test_the_noise_of_every_joint_is_within_five_percent(result: dict[str, Any]) -> None:
    print(result["noise_std"])
    assert result["noise_method"] == "periods"
    assert result["noise_std"] == pytest.approx(NOISE_STD, rel=0.05)


def test_wls_is_nowhere_less_certain_than_ls(
    client: httpx2.Client, campaign: dict[str, Any], result: dict[str, Any]
) -> None:
    weighted, plain = stds(result), stds(identified(client, campaign, options={"estimator": "ls"}))
    ratios = {name: weighted[name] / plain[name] for name in weighted}
    print(json.dumps({name: round(ratio, 3) for name, ratio in ratios.items()}))
    assert len(ratios) == 24
    assert max(ratios.values()) <= 1.0, ratios


def test_torque_without_noise_is_predicted_on_a_motion_that_was_held_out(
    client: httpx2.Client, campaign: dict[str, Any]
) -> None:
    held_out = next(step["link"] for step in campaign["steps"] if step["name"] == "held-out design")
    run = client.post(RUNS, json={"excitation": held_out.rsplit("/", 1)[1], "backend": {"name": "sim"}}).json()
    assert until_it_ends(client, run["links"]["events"])["state"] == "finished"
    clean = client.get(run["links"]["self"]).json()["recording"]["name"]
    judged = identified(client, campaign, held_out=[clean])
    print(judged["fit"]["held_out"]["relative_error"])
    assert judged["fit"]["held_out"]["relative_error"] <= 0.02
