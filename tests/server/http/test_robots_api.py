"""Robot files checked over HTTP."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.http.motions import QUICK_DESIGN
from server.http.problem_check import assert_problem
from tauscope.errors import RobotFileError
from tauscope.server.queue.received_files import check_received_robot, read_received_robot

CHECK = "/api/v1/robots/check"
URDF = (
    b'<robot name="arm"><link name="base"/><link name="tool"/><joint name="j" type="revolute"><parent link="base"/>'
    b'<child link="tool"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
)
URDF_ROBOT = b"name: arm\nkinematics: {urdf: {file: arm.urdf, base: base, tip: tool}}\n"
MJCF = b"""<mujoco><worldbody><body name="a"><joint name="one" axis="0 1 0"/><geom size=".1" pos=".2 0 0"/></body>
</worldbody></mujoco>"""


@pytest.fixture
def client(module_client: TestClient) -> TestClient:
    return module_client


def test_a_robot_file_at_a_glance(client: TestClient, paper_robot: bytes) -> None:
    report = client.post(CHECK, files={"robot": ("arm.yaml", paper_robot)}).json()
    assert report["name"] == "paper-arm"
    assert [joint["number"] for joint in report["joints"]] == [1, 2, 3]
    assert report["joints"][1]["limits"] == {
        "position": [-2.9, 2.9],
        "velocity": 2.0,
        "acceleration": 5.0,
        "torque": 40.0,
    }
    assert report["total_mass"] == pytest.approx(2 * 2**0.5)


def test_the_same_robot_as_json(client: TestClient, paper_robot: bytes) -> None:
    from ruamel.yaml import YAML

    robot: Any = YAML(typ="safe").load(paper_robot)
    inline = client.post(CHECK, json={"robot": robot}).json()
    assert inline == client.post(CHECK, files={"robot": ("robot", paper_robot)}).json()


def test_a_urdf_comes_as_a_part_of_its_own(client: TestClient) -> None:
    files = {"robot": ("arm.yaml", URDF_ROBOT), "urdf": ("arm.urdf", URDF)}
    assert client.post(CHECK, files=files).json()["joints"][0]["limits"]["position"] == [-1.0, 1.0]
    problem = assert_problem(client.post(CHECK, files={"robot": ("arm.yaml", URDF_ROBOT)}), "robot-file", 422)
    assert "'arm.urdf' was not sent" in problem["detail"]


def test_a_urdf_or_mjcf_comes_by_itself(client: TestClient) -> None:
    report = client.post(CHECK, files={"robot": ("arm.urdf", URDF)}).json()
    assert report["joints"][0]["limits"]["position"] == [-1.0, 1.0]
    assert any("deepest leaf" in finding["text"] for finding in report["findings"])
    report = client.post(CHECK, files={"robot": ("arm.xml", MJCF)}).json()
    assert [joint["name"] for joint in report["joints"]] == ["one"]


@pytest.mark.parametrize(
    "part",
    [
        '<include file="/etc/passwd"/>',
        '<asset><mesh file="../../mesh.stl"/></asset>',
        '<asset><texture name="t" type="cube" fileright="/etc/passwd"/></asset>',
        '<asset><model file="other.xml"/></asset>',
        '<compiler meshdir="/"/>',
        '<extension><plugin plugin="mujoco.sdf.torus"/></extension>',
    ],
)
def test_an_mjcf_opens_no_file_of_the_server(client: TestClient, part: str) -> None:
    text = MJCF.replace(b"<worldbody>", part.encode() + b"<worldbody>")
    for files in (
        {"robot": ("arm.xml", text)},
        {"robot": ("arm.yaml", b"name: a\nkinematics: {mjcf: {file: arm.xml}}\n"), "urdf": ("arm.xml", text)},
    ):
        problem = assert_problem(client.post(CHECK, files=files), "robot-file", 422)
        assert "was not sent" in problem["detail"]


@pytest.mark.parametrize("read", [read_received_robot, check_received_robot])
def test_no_program_of_the_server_reads_a_xacro(
    read: Callable[[Path, str], object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would evaluate the file's Python and open any file."""
    program, ran = tmp_path / "xacro", tmp_path / "ran"
    program.write_text(f"#!/bin/sh\ntouch {ran}\ncat $1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    folder = tmp_path / "sent"
    folder.mkdir()
    (folder / "arm.urdf").write_bytes(URDF.replace(b'lower="-1"', b'lower="${-1}"'))
    with pytest.raises(RobotFileError, match="is an expression of xacro; expand the file first"):
        read(folder, "arm.urdf")
    assert not ran.exists()


def test_an_impossible_body_is_a_finding(client: TestClient, tmp_path: Path) -> None:
    link = {"mass": -1.0, "first_moment": [0, 0, 0], "inertia": dict.fromkeys(("xx", "yy", "zz", "xy", "xz", "yz"), 0)}
    robot = {"name": "r", "kinematics": {"dh": [{"theta": 0, "d": 0, "a": 1, "alpha": 0}]}, "model": {"links": [link]}}
    report = client.post(CHECK, json={"robot": robot})
    assert report.json()["findings"][0]["severity"] == "warning"
    assert "the nearest body is used: mass -1 → 0 kg" in report.json()["findings"][0]["text"]
    assert report.json()["findings"][0]["where"].startswith("robot: ")
    named = client.post(CHECK, files={"robot": ("arm.yaml", json.dumps(robot).encode())}).json()
    assert named["findings"][0]["where"].startswith("arm.yaml")
    assert "/" not in named["findings"][0]["where"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "arm.yaml"),
        (b"name: [", "arm.yaml:1"),
        (b"name: r\nname: s\n", "arm.yaml:2"),
        (b"\xff\xfe\x00", "arm.yaml:1: byte 0xff"),
        (b"[" * 5000, "arm.yaml"),
        (b"<robot/>", "arm.yaml: holds no links"),
        (b"<html/>", "arm.yaml:1: its root element is <html>"),
        (b"- 1\n", "arm.yaml"),
        (b"a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\nname: r\n", "arm.yaml"),
    ],
)
def test_files_that_are_no_robot(content: bytes, words: str, client: TestClient) -> None:
    answer = client.post(CHECK, files={"robot": ("arm.yaml", content)})
    assert assert_problem(answer, "robot-file", 422)["detail"].startswith(words)


def test_a_urdf_with_an_entity_bomb(client: TestClient) -> None:
    bomb = b'<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>'
    outside = b'<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]><robot name="&x;"/>'
    for urdf in (bomb, outside):
        answer = client.post(CHECK, files={"robot": ("arm.yaml", URDF_ROBOT), "urdf": ("arm.urdf", urdf)})
        assert assert_problem(answer, "robot-file", 422)["detail"].startswith("arm.")


def test_no_robot_at_all(client: TestClient) -> None:
    assert_problem(client.post(CHECK, files={"urdf": ("arm.urdf", URDF)}), "invalid-request", 422)
    assert_problem(client.post(CHECK, json={}), "invalid-request", 422)
    assert_problem(client.post(CHECK, json={"robot": [False]}), "invalid-request", 422)
    assert_problem(client.post(CHECK, content=b""), "media-type", 415)


def test_a_large_document(client: TestClient) -> None:
    robot = {"name": "r", "kinematics": {"dh": []}, "x": "y" * 4 * 2**20}
    answer = client.post(CHECK, json={"robot": robot})
    assert_problem(answer, "limit-exceeded", 413)


ROBOTS = "/api/v1/robots"


def test_the_same_content_is_one_version(client: TestClient, paper_robot: bytes) -> None:
    first = client.post(ROBOTS, files={"robot": ("arm.yaml", paper_robot)})
    again = client.post(ROBOTS, files={"robot": ("arm.yaml", paper_robot)})
    other = client.post(ROBOTS, files={"robot": ("arm.yaml", paper_robot + b"# another\n")})
    assert (first.status_code, again.status_code, other.status_code) == (201, 200, 201)
    assert first.json() == again.json()
    assert first.json()["name"] == other.json()["name"] == "paper-arm"
    versions = [each["version"] for each in client.get(ROBOTS).json()["versions"]]
    assert {first.json()["version"], other.json()["version"]} <= set(versions)
    assert len(set(versions)) == len(versions)
    shown = client.get(first.headers["Location"]).json()
    assert shown["files"] == [{"name": "arm.yaml", "content": paper_robot.decode()}]
    assert len(shown["report"]["joints"]) == 3


def test_a_kept_robot_with_its_urdf_is_used_by_its_version(client: TestClient) -> None:
    files = {"robot": ("robot.yaml", URDF_ROBOT), "urdf": ("arm.urdf", URDF)}
    kept = client.post(ROBOTS, files=files).json()
    job = client.post("/api/v1/excitations", json={"robot": {"version": kept["version"]}, "options": QUICK_DESIGN})
    assert job.status_code == 202, job.text
    # The job has a copy of its own.
    assert client.delete(kept["link"]).status_code == 204
    robot = client.get(f"{job.headers['location']}/robot").json()
    assert [each["name"] for each in robot["files"]] == ["arm.urdf", "robot.yaml"]


def test_what_is_not_kept(client: TestClient) -> None:
    nobody = "0" * 32
    for answer in (client.get(f"{ROBOTS}/versions/{nobody}"), client.delete(f"{ROBOTS}/versions/{nobody}")):
        assert "GET /api/v1/robots lists them" in assert_problem(answer, "not-found", 404)["detail"]
    answer = client.post("/api/v1/excitations", json={"robot": {"version": nobody}})
    assert_problem(answer, "not-found", 404)
    answer = client.post("/api/v1/excitations", json={"robot": {"version": "../../x"}})
    assert_problem(answer, "not-found", 404)
    assert_problem(client.get(f"{ROBOTS}/versions/..%2fx"), "not-found", 404)
    refused = client.post(ROBOTS, files={"robot": ("arm.yaml", b"name: nothing\n")})
    assert_problem(refused, "robot-file", 422)
