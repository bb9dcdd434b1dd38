"""Recordings over HTTP: sent, listed, checked, removed."""

import hashlib
import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import RECORDINGS
from server.http.problem_check import assert_problem
from tauscope.server.http import Settings

CSV = b"t,q1,tau1\n" + b"".join(b"%.2f,0.1,%.1f\n" % (0.01 * k, k % 3) for k in range(50))


def send(client: TestClient, name: str, content: bytes) -> dict[str, object]:
    answer = client.post(RECORDINGS, files={"file": (name, content)})
    assert answer.status_code == 201, answer.text
    return answer.json()


def test_a_recording_is_kept_with_its_hash(client: TestClient, settings: Settings) -> None:
    answer = client.post(RECORDINGS, files={"file": ("log 1.csv", CSV)})
    assert answer.status_code == 201
    assert answer.headers["location"] == f"{RECORDINGS}/log%201.csv"
    entry = client.get(answer.headers["location"]).json()
    assert (entry["name"], entry["size"], entry["sha256"]) == ("log 1.csv", len(CSV), hashlib.sha256(CSV).hexdigest())
    assert client.get(RECORDINGS).json() == {"recordings": [entry], "next": None}
    assert (settings.recordings_folder / "log 1.csv").read_bytes() == CSV
    assert {file.name for file in settings.recordings_folder.iterdir()} == {".sha256", "log 1.csv"}


def test_the_same_bytes_again_are_welcome_and_others_are_not(client: TestClient, settings: Settings) -> None:
    send(client, "a.csv", CSV)
    assert client.post(RECORDINGS, files={"file": ("a.csv", CSV)}).status_code == 200
    assert_problem(client.post(RECORDINGS, files={"file": ("a.csv", CSV + b"\n")}), "name-taken", 409)
    assert (settings.recordings_folder / "a.csv").read_bytes() == CSV


def test_a_recording_is_checked(client: TestClient) -> None:
    send(client, "a.csv", CSV)
    report = client.get(f"{RECORDINGS}/a.csv/report").json()
    assert (report["name"], report["samples"], report["effort_kind"]) == ("a.csv", 50, "tau")
    assert report["rate_hz"] == pytest.approx(100)
    assert {finding["where"] for finding in report["findings"]} >= {"q1"}
    assert client.get(f"{RECORDINGS}/a.csv/report", params={"joint_count": 1}).status_code == 200


def test_a_channel_without_samples_is_reported_as_null(client: TestClient) -> None:
    send(client, "a.csv", b"t,q1,tau1\n" + b"".join(b"%d,0.1,nan\n" % k for k in range(10)))
    report = client.get(f"{RECORDINGS}/a.csv/report").json()
    assert report["joints"][0]["effort"] == [None, None]
    assert report["missed"] == {"tau1": 10}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"t,q1,tau1\n0,0,0\n1,x,0\n", "a.csv: line 3, column q1"),
        (b"", "a.csv: "),
        (b"PK\x03\x04", "a.csv: "),
        (b"\0" * 99, "a.csv: "),
    ],
)
def test_the_report_on_a_broken_recording_is_a_problem(
    content: bytes, words: str, client: TestClient, settings: Settings
) -> None:
    send(client, "a.csv", content)
    problem = assert_problem(client.get(f"{RECORDINGS}/a.csv/report"), "recording", 422)
    assert problem["detail"].startswith(words)
    assert str(settings.data_folder) not in problem["detail"]


def test_a_recording_of_other_joints(client: TestClient) -> None:
    send(client, "a.csv", CSV)
    answer = client.get(f"{RECORDINGS}/a.csv/report", params={"joint_count": 6})
    assert_problem(answer, "recording-mismatch", 422)
    for wrong in ("0", "-1", "1.5", "six", "1001"):
        answer = client.get(f"{RECORDINGS}/a.csv/report", params={"joint_count": wrong})
        assert_problem(answer, "invalid-request", 422)


@pytest.mark.usefixtures("reader_processes")
def test_a_check_whose_process_dies_is_a_problem(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    client.post(RECORDINGS, files={"file": ("a.csv", CSV)})
    monkeypatch.setattr("tauscope.server.queue.received_files.check_kept_recording", Deadly())
    assert_problem(client.get(f"{RECORDINGS}/a.csv/report"), "worker-lost", 500)


class Deadly:
    """Ends the process that receives it; a function of this module would have it import all of the service first."""

    def __call__(self, *_: object) -> None: ...

    def __reduce__(self) -> tuple[Callable[[int], None], tuple[int]]:
        return signal.raise_signal, (signal.SIGKILL,)


def test_a_recording_is_removed(client: TestClient, settings: Settings) -> None:
    send(client, "a.csv", CSV)
    assert client.delete(f"{RECORDINGS}/a.csv").status_code == 204
    assert_problem(client.get(f"{RECORDINGS}/a.csv"), "not-found", 404)
    assert_problem(client.delete(f"{RECORDINGS}/a.csv"), "not-found", 404)
    assert {file.name for file in settings.recordings_folder.iterdir()} == {".sha256"}


@pytest.mark.parametrize(
    "name",
    [
        "..",
        "%2e%2e",
        "..%2f..%2fsecret.csv",
        "%2fetc%2fpasswd",
        "a%00.csv",
        ".sha256",
        "link.csv",
        "missing.csv",
        "a%0d%0aX-Evil:1",
    ],
)
@pytest.mark.parametrize("below", ["", "/report"])
def test_nothing_outside_the_folder_is_reached(
    name: str, below: str, client: TestClient, settings: Settings, tmp_path: Path
) -> None:
    (tmp_path / "secret.csv").write_bytes(CSV)
    (settings.recordings_folder / "link.csv").symlink_to(tmp_path / "secret.csv")
    for method in ("GET", "DELETE") if not below else ("GET",):
        answer = client.request(method, f"{RECORDINGS}/{name}{below}")
        assert answer.status_code in (404, 405), answer.text
        assert_problem(answer, answer.json()["code"], answer.status_code)
    assert (tmp_path / "secret.csv").read_bytes() == CSV


@pytest.mark.parametrize(
    "name", ["../a.csv", "..", "", ".a", "a/b.csv", "C:\\a\\..", "a\nb.csv", "ü.csv", "a" * 129, "a.csv "]
)
def test_hostile_names_are_refused_and_nothing_is_written(
    name: str, client: TestClient, settings: Settings, tmp_path: Path
) -> None:
    before = {path for path in tmp_path.rglob("*") if path.name not in (".lock", "audit.jsonl")}
    answer = client.post(RECORDINGS, files={"file": (name, CSV)})
    assert answer.status_code in (400, 422), answer.text
    assert_problem(answer, answer.json()["code"], answer.status_code)
    assert {path for path in tmp_path.rglob("*") if path.name not in (".lock", "audit.jsonl")} == before


def test_an_upload_that_breaks_off_leaves_nothing(client: TestClient, settings: Settings) -> None:
    head = b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.csv"\r\n\r\nt,q1'
    answer = client.post(RECORDINGS, content=head, headers={"content-type": "multipart/form-data; boundary=b"})
    assert "cut off" in assert_problem(answer, "bad-request", 400)["detail"]
    assert {file.name for file in settings.recordings_folder.iterdir()} == {".sha256"}


@pytest.mark.parametrize(
    ("content_type", "body", "code", "status"),
    [
        ("multipart/form-data", b"x", "bad-request", 400),
        ("multipart/form-data; boundary=b", b"", "bad-request", 400),
        ("multipart/form-data; boundary=b", b"x", "bad-request", 400),
        ("multipart/form-data; boundary=" + "b" * 5000, b"x", "bad-request", 400),
        ("multipart/form-data; boundary=b", b"--b--\r\n", "invalid-request", 422),
        ("multipart/form-data; boundary=b", b"--b\r\n\r\nx\r\n--b--\r\n", "invalid-request", 422),
        (
            "multipart/form-data; boundary=b",
            b"--b\r\nA: " + b"x" * 9999 + b"\r\n\r\nx\r\n--b--\r\n",
            "bad-request",
            400,
        ),
        ("multipart/form-data; boundary=b", b"--b\r\n" + b"A: b\r\n" * 99 + b"\r\nx\r\n--b--\r\n", "bad-request", 400),
        ("application/json", b"{}", "media-type", 415),
    ],
)
def test_bodies_that_are_no_form(
    content_type: str, body: bytes, code: str, status: int, module_client: TestClient
) -> None:
    assert_problem(module_client.post(RECORDINGS, content=body, headers={"content-type": content_type}), code, status)


def test_an_upload_is_limited_by_its_own_word_and_by_count(client: TestClient, settings: Settings) -> None:
    announced = client.post(RECORDINGS, files={"file": ("a.csv", bytes(settings.max_upload_bytes))})
    assert str(settings.max_upload_bytes) in assert_problem(announced, "limit-exceeded", 413)["detail"]

    def endless() -> Iterator[bytes]:
        yield b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.csv"\r\n\r\n'
        for _ in range(6):
            yield bytes(2**20)

    counted = client.post(RECORDINGS, content=endless(), headers={"content-type": "multipart/form-data; boundary=b"})
    assert_problem(counted, "limit-exceeded", 413)
    assert {file.name for file in settings.recordings_folder.iterdir()} == {".sha256"}


def test_a_full_disk_is_said(client: TestClient, settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    assert_problem(client.post(RECORDINGS, files={"file": ("a.csv", CSV)}), "storage-full", 507)
    assert {file.name for file in settings.recordings_folder.iterdir()} == {".sha256"}


@pytest.mark.parametrize(("name", "kind"), [("a b.csv", "text/csv"), ("log.mcap", "application/octet-stream")])
def test_a_recording_is_fetched_as_it_was_sent(name: str, kind: str, client: TestClient) -> None:
    content = bytes(range(256)) * 1000
    client.post(RECORDINGS, files={"file": (name, content)})
    answer = client.get(f"{RECORDINGS}/{name}/content")
    assert (answer.status_code, answer.content) == (200, content)
    assert answer.headers["content-type"].partition(";")[0] == kind
    assert answer.headers["content-disposition"].startswith("attachment")
    assert answer.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("name", ["nothing.csv", ".sha256", "..", "%2e%2e%2f.lock"])
def test_nothing_else_is_fetched(name: str, module_client: TestClient) -> None:
    assert_problem(module_client.get(f"{RECORDINGS}/{name}/content"), "not-found", 404)


CHECK = "/api/v1/mappings/check"
FOREIGN = b"timestamp,actual_q_0,target_moment_0\n" + b"".join(
    b"%.2f,%.3f,%.1f\n" % (0.01 * k, 0.1 * (k % 7), k % 3) for k in range(50)
)


def check(client: TestClient, content: bytes, request: dict[str, object] | None = None) -> dict[str, Any]:
    files = {"file": ("log.csv", content), "request": (None, json.dumps(request or {}), "application/json")}
    answer = client.post(CHECK, files=files)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_recording_is_understood_and_nothing_of_it_is_kept(client: TestClient, settings: Settings) -> None:
    found = check(client, CSV)
    assert found["mapping"]["columns"] == {"t": "t", "q1": "q1", "tau1": "tau1"}
    assert found["mapping"]["units"] == {"t": "s", "q": "rad", "qd": "rad", "tau": "Nm"}
    assert (found["mapping"]["is_guessed"], found["report"]["samples"], found["problem"]) == (False, 50, None)
    assert client.get(RECORDINGS).json()["recordings"] == []
    assert [path.name for path in settings.recordings_folder.iterdir() if path.name != ".sha256"] == []


def test_a_mapping_is_guessed_from_other_names_and_a_stated_one_is_used(client: TestClient) -> None:
    found = check(client, FOREIGN)
    assert found["mapping"]["columns"] == {"t": "timestamp", "q1": "actual_q_0", "tau1": "target_moment_0"}
    assert (found["mapping"]["is_guessed"], found["report"]["samples"]) == (True, 50)
    columns = {"t": "timestamp", "q1": "target_moment_0", "tau1": "actual_q_0"}
    stated = check(client, FOREIGN, {"columns": columns, "units": {"t": "ms"}})
    assert (stated["mapping"]["columns"], stated["mapping"]["units"]["t"]) == (columns, "ms")
    assert (stated["mapping"]["is_guessed"], stated["report"]["duration_s"]) == (False, pytest.approx(0.49e-3))


def test_what_is_refused_comes_with_its_columns_and_the_reason(client: TestClient) -> None:
    found = check(client, b"time,angle,torque\n0,1,2\n1,x,3\n")
    assert found["report"] is None
    assert found["problem"] == "log.csv: line 3, column q1: 'x' is not a number"
    partial = check(client, b"time,angle,humidity\n0,1,2\n1,2,3\n")
    assert partial["mapping"]["columns"] == {"t": "time", "q1": "angle"}
    assert partial["problem"].startswith("log.csv: ")


def test_no_recording_and_a_wrong_request_are_refused(client: TestClient) -> None:
    assert_problem(client.post(CHECK, files={"request": (None, "{}")}), "invalid-request", 422)
    files = {"file": ("log.csv", CSV), "request": (None, '{"units": {"t": "weeks"}}')}
    assert_problem(client.post(CHECK, files=files), "invalid-request", 422)
