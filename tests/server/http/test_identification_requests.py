"""Requests for an identification that are refused, each with the place and nothing kept."""

import json
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS
from server.http.problem_check import assert_problem
from tauscope.server.http import Settings

ROBOT = {"name": "r", "kinematics": {"dh": [{"theta": 0.0, "d": 0.0, "a": 0.5, "alpha": 0.0}]}}
ROBOT_FILE = json.dumps(ROBOT).encode()
LISTS_B = b'{"recordings": ["b.csv"]}'
HAS_ROBOT = json.dumps({"robot": ROBOT}).encode()
CSV = b"t,q1,tau1\n" + b"".join(b"%d,0.1,1.5\n" % k for k in range(10))


def urdf_robot(file: str) -> dict[str, Any]:
    return {"name": "r", "kinematics": {"urdf": {"file": file, "base": "a", "tip": "b"}}}


@pytest.fixture
def settings(module_settings: Settings) -> Settings:
    return module_settings


@pytest.fixture
def client(module_client: TestClient) -> TestClient:
    return module_client


@pytest.fixture(autouse=True)
def nothing_is_kept(settings: Settings, client: TestClient) -> Any:
    yield
    assert list((settings.data_folder / "identifications").iterdir()) == []


@pytest.fixture
def kept(client: TestClient) -> None:
    client.post(RECORDINGS, files={"file": ("a.csv", CSV)})


@pytest.mark.usefixtures("kept")
@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"robot": "arm.yaml"}, "body.robot"),
        ({"robot": [False]}, "body.robot"),
        ({"recordings": "a.csv"}, "body.recordings"),
        ({"recordings": [False]}, "body.recordings.0"),
        ({"recordings": [1]}, "body.recordings.0"),
        ({"recordings": {"a.csv": 1}}, "body.recordings"),
        ({"recordings": ["a.csv", "a.csv"]}, "body"),
        ({"recordings": ["a.csv", "../../../etc/passwd"]}, "body.recordings.1"),
        ({"recordings": ["/etc/passwd"]}, "body.recordings.0"),
        ({"recordings": ["a.csv\u0000"]}, "body.recordings.0"),
        ({"recordings": [".sha256"]}, "body.recordings.0"),
        ({"recordings": ["a.csv"] * 1001}, "body.recordings"),
        ({"options": {"estimator": "WLS"}}, "body.options.estimator"),
        ({"options": {"estimator": None}}, "body.options.estimator"),
        ({"options": {"cutoff_hz": "10"}}, "body.options.cutoff_hz"),
        ({"options": {"cutoff_hz": True}}, "body.options.cutoff_hz"),
        ({"options": {"cutoff_hz": 0}}, "body.options.cutoff_hz"),
        ({"options": {"cutoff_hz": -5.0}}, "body.options.cutoff_hz"),
        ({"options": {"rotor_inertia": 1}}, "body.options.rotor_inertia"),
        ({"options": {"rotor_inertia": "yes"}}, "body.options.rotor_inertia"),
        ({"options": {"cutof": 1.0}}, "body.options.cutof"),
        ({"recording": ["a.csv"]}, "body.recording"),
    ],
)
def test_wrong_fields(change: dict[str, Any], field: str, client: TestClient) -> None:
    body = {"robot": ROBOT, "recordings": ["a.csv"], **change}
    problem = assert_problem(client.post(IDENTIFICATIONS, json=body), "invalid-request", 422)
    named = [error["field"] for error in problem["errors"]]
    assert any(name == field or name.startswith(f"{field}.") for name in named), named
    assert named[0] in problem["detail"]


@pytest.mark.parametrize(
    "body", [b"", b"{", b"[]", b"null", b"\xff\xfe", b'{"robot": NaN}', b"1" * 10000, b"[" * 10000]
)
def test_bodies_that_are_no_document(body: bytes, client: TestClient) -> None:
    answer = client.post(IDENTIFICATIONS, content=body, headers={"content-type": "application/json"})
    assert_problem(answer, "invalid-request", 422)


@pytest.mark.parametrize(
    ("robot", "words"),
    [
        ({}, "robot: "),
        ({**ROBOT, "joints": [False]}, "robot: joints[0] (joint 1)"),
        ({**ROBOT, "gravity": [0, 0, "9.81"]}, "robot: gravity[2]: '9.81' is text"),
        ({**ROBOT, "name": 7}, "robot: name"),
        ({**ROBOT, "color": "red"}, "robot: color: unknown key 'color'"),
        ({**ROBOT, "gravity": [0, 0, 1e300]}, "robot: gravity[2]"),
        (
            {"name": "r", "kinematics": {"urdf": {"file": "/etc/passwd", "base": "a", "tip": "b"}}},
            "robot: kinematics.urdf",
        ),
        (
            {"name": "r", "kinematics": {"urdf": {"file": "robot.json", "base": "a", "tip": "b"}}},
            "robot: kinematics.urdf",
        ),
    ],
)
@pytest.mark.usefixtures("kept")
def test_robots_that_are_not_valid(robot: dict[str, Any], words: str, client: TestClient) -> None:
    answer = client.post(IDENTIFICATIONS, json={"robot": robot, "recordings": ["a.csv"]})
    assert words in assert_problem(answer, "robot-file", 422)["detail"]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_numbers_that_json_does_not_know(number: str, client: TestClient) -> None:
    body = json.dumps({"robot": {**ROBOT, "gravity": [0, 0, 1]}, "recordings": ["a.csv"]}).replace(
        "[0, 0, 1]", f"[0,0,{number}]"
    )
    answer = client.post(IDENTIFICATIONS, content=body, headers={"content-type": "application/json"})
    assert answer.status_code == 422
    assert answer.json()["code"] in ("robot-file", "invalid-request")


def test_a_recording_that_is_not_on_the_server(client: TestClient) -> None:
    answer = client.post(IDENTIFICATIONS, json={"robot": ROBOT, "recordings": ["missing.csv"]})
    assert "'missing.csv'" in assert_problem(answer, "not-found", 404)["detail"]


@pytest.mark.usefixtures("kept")
@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"recordings": ["a.csv"]}, "no robot"),
        ({"robot": ROBOT}, "no recording"),
        ({"robot": ROBOT, "recordings": []}, "no recording"),
        ({"robot": ROBOT, "recordings": ["a.csv"], "held_out": ["a.csv"]}, "a.csv and a.csv hold the same bytes"),
    ],
)
def test_what_is_missing_or_makes_no_sense(body: dict[str, Any], words: str, client: TestClient) -> None:
    problem = assert_problem(client.post(IDENTIFICATIONS, json=body), "invalid-request", 422)
    assert words in problem["detail"]


def post_form(client: TestClient, *parts: tuple[str, str | None, bytes]) -> Any:
    return client.post(IDENTIFICATIONS, files=[(name, (filename, content)) for name, filename, content in parts])


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ([("recordings", "a.csv", CSV)], "no robot was sent"),
        ([("robot", "r.yaml", ROBOT_FILE)], "no recording was sent"),
        ([("robot", "r.yaml", ROBOT_FILE), ("robot", "s.yaml", ROBOT_FILE)], "part robot: more than 1 files"),
        ([("robot", "r.yaml", ROBOT_FILE), ("recording", "a.csv", CSV)], "a part 'recording'; known parts: request"),
        ([("recordings", "a.csv", CSV), ("recordings", "a.csv", CSV)], "two files are named a.csv"),
        ([("robot", "r.yaml", ROBOT_FILE), ("urdf", "r.yaml", b"<robot/>")], "two files are named r.yaml"),
        ([("recordings", "../../a.csv", CSV)], "file name '../../a.csv'"),
        ([("recordings", "/etc/cron.d/x", CSV)], "file name '/etc/cron.d/x'"),
        ([("recordings", ".ssh", CSV)], "file name '.ssh'"),
        ([("recordings", "a\u0000.csv", CSV)], "file name"),
        ([("recordings", "x" * 300, CSV)], "file name"),
        ([("recordings", None, CSV)], "part recordings: is not a file"),
        ([("request", None, LISTS_B), ("robot", "r", ROBOT_FILE), ("recordings", "a.csv", CSV)], "but is not listed"),
        ([("request", None, b"[]")], "part request"),
        ([("request", None, b"{}"), ("request", None, b"{}")], "part request: is there twice"),
        ([("request", None, HAS_ROBOT), ("robot", "r.yaml", ROBOT_FILE)], "the robot came twice"),
    ],
)  # fmt: skip
def test_forms_that_are_refused(parts: list[Any], words: str, client: TestClient) -> None:
    answer = post_form(client, *parts)
    assert answer.status_code in (413, 422), answer.text
    assert words in assert_problem(answer, answer.json()["code"], answer.status_code)["detail"]


def test_a_robot_file_never_leads_to_a_file_of_the_server(client: TestClient, tmp_path: Path) -> None:
    secret = tmp_path / "secret.urdf"
    secret.write_text("<robot name='s'><link name='secret-link'/></robot>", encoding="utf-8")
    for file in (str(secret), "../" * 12 + str(secret).lstrip("/"), "..", "arm.urdf"):
        robot = json.dumps(urdf_robot(file)).encode()
        answer = post_form(client, ("robot", "r.yaml", robot), ("recordings", "a.csv", CSV))
        problem = assert_problem(answer, "robot-file", 422)
        assert "was not sent" in problem["detail"]
        assert "secret-link" not in answer.text


def test_a_robot_file_error_names_file_and_line_and_no_folder(client: TestClient, settings: Settings) -> None:
    text = b"name: r\nkinematics:\n  dh:\n    - {theta: 0.0, d: 0, a: zero, alpha: 0}\n"
    problem = assert_problem(
        post_form(client, ("robot", "r.yaml", text), ("recordings", "a.csv", CSV)), "robot-file", 422
    )
    assert problem["detail"].startswith("r.yaml:4: kinematics.dh[0].a (joint 1)")
    assert str(settings.data_folder) not in problem["detail"]


def test_more_recordings_than_accepted(client: TestClient) -> None:
    parts = [("recordings", f"{number}.csv", CSV + b"#%d" % number) for number in range(4)]
    problem = assert_problem(post_form(client, ("robot", "r.yaml", ROBOT_FILE), *parts), "limit-exceeded", 413)
    assert "more than 3" in problem["detail"]
    parts[3:] = [("held_out", "h.csv", CSV)]
    assert_problem(post_form(client, ("robot", "r.yaml", ROBOT_FILE), *parts), "limit-exceeded", 413)


def test_a_robot_file_that_is_too_large(client: TestClient) -> None:
    answer = post_form(client, ("robot", "r.yaml", ROBOT_FILE + b"#" * 2**20), ("recordings", "a.csv", CSV))
    assert "r.yaml" in assert_problem(answer, "limit-exceeded", 413)["detail"]


@pytest.mark.parametrize("media_type", [None, "text/csv", "application/x-www-form-urlencoded", "application/jsonx"])
def test_other_media_types(media_type: str | None, client: TestClient) -> None:
    headers = {} if media_type is None else {"content-type": media_type}
    answer = client.post(IDENTIFICATIONS, content=b"x", headers=headers)
    assert_problem(answer, "media-type", 415)
    assert answer.headers["accept-post"] == "application/json, multipart/form-data"
