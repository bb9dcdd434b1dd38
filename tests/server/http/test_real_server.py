"""The service as it is run: a process of its own, a real socket, real workers."""

import http.client
import json
import signal
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest

from server.conftest import IDENTIFICATIONS, RECORDINGS
from server.http.problem_check import assert_problem
from server.http.serving import served
from server.queue.waiting import wait_until
from tauscope.errors import TauscopeError
from tauscope.server.http import Settings, serve

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def data_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("served") / "data"


@pytest.fixture(scope="module")
def server(data_folder: Path, paper_robot: bytes, paper_recordings: tuple[bytes, bytes]) -> Iterator[httpx2.Client]:
    """A service that is ended in the middle of work, and ends without a word: that waits for the next start."""
    files = [("robot", ("arm.yaml", paper_robot)), ("recordings", ("train.csv", paper_recordings[0]))]
    with served(data_folder) as service:
        yield service.client
        here = service.client.post(IDENTIFICATIONS, files=files).headers["location"]
        wait_until(lambda: service.client.get(here).json()["state"] != "queued")
    assert service.process.returncode in (0, -signal.SIGTERM)


def ended(server: httpx2.Client, here: str) -> dict[str, Any]:
    """The state of an identification that has ended."""

    def has_ended() -> bool:
        status = server.get(here).json()
        if status["state"] in ("queued", "running"):
            assert status["links"]["result"] is None
            return False
        return True

    wait_until(has_ended)
    return server.get(here).json()


def test_all_the_way(server: httpx2.Client, paper_robot: bytes, paper_recordings: tuple[bytes, bytes]) -> None:
    assert server.get("/healthz").json()["status"] == "ok"
    kept = server.post(RECORDINGS, files={"file": ("test.csv", paper_recordings[1])})
    assert kept.status_code == 201
    report = server.get(f"{RECORDINGS}/test.csv/report").json()
    assert report["samples"] == 2000
    answer = server.post(
        IDENTIFICATIONS,
        files=[("robot", ("arm.yaml", paper_robot)), ("recordings", ("train.csv", paper_recordings[0]))],
        data={"request": json.dumps({"held_out": ["test.csv"]})},
    )
    assert answer.status_code == 202
    status = ended(server, answer.headers["location"])
    assert status["state"] == "succeeded", status
    result = server.get(status["links"]["result"]).json()
    assert result["schema"] == "tauscope.identification/1"
    assert [entry["stiction"] for entry in result["friction"]] == pytest.approx([2, 1, 2], abs=0.5)
    for link in status["links"]["exports"].values():
        assert server.get(link).status_code == 200


def test_a_broken_recording(server: httpx2.Client, paper_robot: bytes) -> None:
    files = [
        ("robot", ("arm.yaml", paper_robot)),
        ("recordings", ("broken.csv", b"t,q1,q2,q3,tau1,tau2,tau3\n0,0,0,0,0,0\n")),
    ]
    here = server.post(IDENTIFICATIONS, files=files).headers["location"]
    assert ended(server, here)["state"] == "failed"
    problem = assert_problem(server.get(f"{here}/result"), "recording", 422)
    assert problem["detail"].startswith("broken.csv: line 2")


@pytest.mark.parametrize(
    ("name", "size", "code", "status"),
    [("large.csv", 15_000_000, "limit-exceeded", 413), ("..", 7_000_000, "invalid-request", 422)],
)
@pytest.mark.parametrize("is_announced", [True, False])
def test_a_client_that_is_still_sending_gets_its_answer(
    name: str, size: int, code: str, status: int, is_announced: bool, server: httpx2.Client, data_folder: Path
) -> None:
    head = f'--b\r\nContent-Disposition: form-data; name="file"; filename="{name}"\r\n\r\n'.encode()
    body = head + bytes(size) + b"\r\n--b--\r\n"
    pieces = (body[start : start + 2**16] for start in range(0, len(body), 2**16))
    headers = {"content-type": "multipart/form-data; boundary=b"}
    # This client, like many, reads nothing before it has sent everything.
    url = httpx2.URL(str(server.base_url))
    connection = http.client.HTTPConnection(url.host, url.port, timeout=60)
    connection.request("POST", RECORDINGS, body if is_announced else pieces, headers, encode_chunked=not is_announced)
    answer = connection.getresponse()
    problem = json.loads(answer.read())
    connection.close()
    assert (answer.status, problem["code"]) == (status, code)
    assert server.get("/healthz").status_code == 200
    assert not list((data_folder / "recordings").glob(".incoming-*"))


def test_a_client_that_asks_for_leave_first_is_refused_at_once(server: httpx2.Client) -> None:
    url = httpx2.URL(str(server.base_url))
    request = (
        f"POST {RECORDINGS} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: multipart/form-data; boundary=b\r\n"
        "Content-Length: 99999999\r\nExpect: 100-continue\r\n\r\n"
    )
    with socket.create_connection((url.host, url.port or 0), timeout=20) as connection:
        connection.sendall(request.encode())
        answer = b""
        while piece := connection.recv(4096):
            answer += piece
    assert answer.startswith(b"HTTP/1.1 413 ")
    assert b'"code":"limit-exceeded"' in answer


def test_a_second_service_says_why_it_does_not_start(server: httpx2.Client, data_folder: Path) -> None:
    assert server.get("/healthz").status_code == 200
    with pytest.raises(TauscopeError, match="another tauscope service works with this folder"):
        serve(Settings(data_folder=data_folder, port=0), lambda _: None)


def test_why_a_service_does_not_start(server: httpx2.Client, tmp_path: Path) -> None:
    port = httpx2.URL(str(server.base_url)).port or 0
    with pytest.raises(TauscopeError, match="Address already in use"):
        serve(Settings(data_folder=tmp_path, port=port), lambda _: None)
    with pytest.raises(TauscopeError, match="others could reach it"):
        serve(Settings(data_folder=tmp_path, host="0.0.0.0"), lambda _: None)
    (tmp_path / "file").touch()
    with pytest.raises(TauscopeError, match="cannot be used as data folder"):
        serve(Settings(data_folder=tmp_path / "file", port=0), lambda _: None)
