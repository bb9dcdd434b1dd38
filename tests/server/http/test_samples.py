"""Samples of a recording for a plot, and the robot and report of a job: what the page reads beside the rest."""

import json
import re

import numpy as np
import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS


def columns(content: bytes) -> tuple[dict[str, int], dict[str, np.ndarray]]:
    length = int.from_bytes(content[:4], "little")
    header = json.loads(content[4 : 4 + length])
    values = np.frombuffer(content[4 + length :], "<f4").reshape(len(header["columns"]), header["shown"])
    return header, dict(zip(header["columns"], values, strict=True))


def keep(client: TestClient, content: bytes, name: str = "motion.csv") -> None:
    assert client.post(RECORDINGS, files={"file": (name, content)}).status_code == 201


def test_samples_are_those_of_the_file(client: TestClient, paper_recordings: tuple[bytes, bytes]) -> None:
    keep(client, paper_recordings[0])
    answer = client.get(f"{RECORDINGS}/motion.csv/samples")
    assert answer.status_code == 200
    header, found = columns(answer.content)
    names = paper_recordings[0].split(b"\n", 1)[0].decode().strip().split(",")
    rows = np.genfromtxt(paper_recordings[0].splitlines()[1:], delimiter=",")
    assert header["samples"] == header["shown"] == len(rows)
    assert header["joint_count"] == 3
    for name in ("q1", "q3", "tau2"):
        np.testing.assert_allclose(found[name], rows[:, names.index(name)], rtol=1e-6)
    np.testing.assert_allclose(found["t"], rows[:, 0] - rows[0, 0], rtol=1e-6, atol=1e-7)


def test_fewer_samples_keep_every_peak(client: TestClient, paper_recordings: tuple[bytes, bytes]) -> None:
    keep(client, paper_recordings[0])
    _, whole = columns(client.get(f"{RECORDINGS}/motion.csv/samples").content)
    header, thin = columns(client.get(f"{RECORDINGS}/motion.csv/samples?most=240").content)
    assert header["shown"] <= 240 < header["samples"]
    for name, values in thin.items():
        assert (values.min(), values.max()) == (whole[name].min(), whole[name].max())
    assert np.all(np.diff(thin["t"]) > 0)


def test_a_recording_that_is_none_is_said_to_be(client: TestClient) -> None:
    keep(client, b"t,q1,tau1\n0,0,0\n0,1,1\n")
    answer = client.get(f"{RECORDINGS}/motion.csv/samples")
    assert answer.json()["code"] == "recording"
    assert client.get(f"{RECORDINGS}/other.csv/samples").status_code == 404


@pytest.mark.usefixtures("drawn_figures")
def test_an_identification_has_plots_a_report_and_its_robot(
    client: TestClient, paper_robot: bytes, paper_recordings: tuple[bytes, bytes]
) -> None:
    files = [
        ("robot", ("arm.yaml", paper_robot)),
        ("recordings", ("train.csv", paper_recordings[0])),
        ("held_out", ("test.csv", paper_recordings[1])),
    ]
    links = client.post(IDENTIFICATIONS, files=files).json()["links"]
    plots = client.get(links["plots"]).json()
    assert plots["schema"] == "tauscope.identification-plots/1"
    assert [curve["joint"] for curve in plots["torque"]] == ["joint1", "joint2", "joint3"]
    assert {(curve["recording"], curve["held_out"]) for curve in plots["torque"]} == {("test.csv", True)}
    residual = np.array(plots["torque"][0]["measured"]) - np.array(plots["torque"][0]["predicted"])
    assert 0.3 < residual.std() < 0.8  # the paper's noise, 0.5 Nm, and nothing else
    friction = plots["friction"][0]
    at = np.searchsorted(friction["velocity"], 1.0)
    assert abs(friction["friction"][at] - (2.0 - 0.3 * 0.94 + 0.5)) < 4 * friction["std"][at] + 0.05
    report = client.get(links["report"])
    assert report.headers["content-type"] == "text/html; charset=utf-8"
    assert "script-src" not in report.headers["content-security-policy"]
    assert "default-src 'none'" in report.headers["content-security-policy"]
    assert "tauscope identify arm.yaml train.csv --held-out test.csv" in report.text
    assert not re.search(r"https?:|<script", report.text)
    robot = client.get(f"{links['self']}/robot").json()
    assert robot["robot_file"] == "arm.yaml"
    assert robot["files"] == [{"name": "arm.yaml", "content": paper_robot.decode()}]
    before = np.array(robot["report"]["joints"][0]["before"]).reshape(4, 4)
    np.testing.assert_allclose(before[:3, :3] @ before[:3, :3].T, np.eye(3), atol=1e-12)
