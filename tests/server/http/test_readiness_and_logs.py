"""Readiness that means it, logs that tell no secret, and the word to systemd."""

import asyncio
import io
import json
import logging
import socket
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from server.http.problem_check import assert_problem
from tauscope.server.http import Settings, readiness
from tauscope.server.http.app import log_as_json
from tauscope.server.http.services import Services


def services_of(client: TestClient) -> Services:
    return client.app.state.services  # type: ignore[attr-defined]


def test_a_sound_service_is_ready(client: TestClient) -> None:
    assert client.get("/readyz").json() == {"status": "ready"}


def test_a_disk_that_takes_nothing(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    assert "Read-only" in assert_problem(client.get("/readyz"), "not-ready", 503)["detail"]
    assert client.get("/healthz").status_code == 200


def test_a_disk_that_is_nearly_full(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readiness, "LEAST_FREE_BYTES", 2**60)
    assert "MiB left" in assert_problem(client.get("/readyz"), "not-ready", 503)["detail"]


def test_a_disk_that_hangs(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    let_go = threading.Event()
    monkeypatch.setattr(readiness, "TIMEOUT_S", 0.05)
    monkeypatch.setitem(services_of(client).readiness.checks, "disk", lambda: let_go.wait(20.0) and None)
    try:
        assert "not answered" in assert_problem(client.get("/readyz"), "not-ready", 503)["detail"]
    finally:
        let_go.set()


def test_a_service_that_ends_or_has_lost_entries(client: TestClient) -> None:
    services = services_of(client)
    services.audit.lost = 2
    assert "2 entries" in assert_problem(client.get("/readyz"), "not-ready", 503)["detail"]
    services.audit.lost = 0
    services.closing.set()
    assert "ending" in assert_problem(client.get("/readyz"), "not-ready", 503)["detail"]


def test_a_cluster_that_is_away(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(services_of(client).jobs, "can_work", lambda: False)
    assert "Dask cluster" in assert_problem(client.get("/readyz"), "not-ready", 503)["detail"]


@pytest.mark.parametrize("damage", ["overwritten", "cut off", "gone"])
def test_a_database_that_is_damaged(client: TestClient, settings: Settings, damage: str) -> None:
    path = settings.data_folder / "tauscope.db"
    if damage == "gone":
        path.unlink()
    else:
        content = path.read_bytes()
        path.write_bytes(bytes(len(content)) if damage == "overwritten" else content[:10_000])
    detail = assert_problem(client.get("/readyz"), "not-ready", 503)["detail"]
    assert "tauscope.db: is damaged" in detail
    assert "restore a backup" in detail
    assert 'tauscope_ready{part="database"} 0.0' in client.get("/metrics").text


def test_a_clock_that_was_never_set_or_is_set_back() -> None:
    wall = [1_800_000_000.0]
    clock = readiness.Clock(lambda: wall[0], lambda: 0.0)
    assert clock.check() is None
    wall[0] -= 61.0
    assert "set back by 61 s" in (clock.check() or "")
    wall[0] = 0.0
    assert "the clock says 1970-01-01" in (clock.check() or "")


def test_every_part_has_a_metric(client: TestClient) -> None:
    text = client.get("/metrics").text
    for part in ("service", "database", "disk", "workers", "clock", "audit log"):
        assert f'tauscope_ready{{part="{part}"}} 1.0' in text


@pytest.fixture
def logged() -> Iterator[io.StringIO]:
    """What is logged as JSON."""
    root, stream = logging.getLogger(), io.StringIO()
    before = root.handlers[:], root.level, logging.getLogger("tauscope").level
    log_as_json(stream=stream)
    yield stream
    root.handlers[:] = before[0]
    root.setLevel(before[1])
    logging.getLogger("tauscope").setLevel(before[2])


def test_a_request_is_one_line(client: TestClient, logged: io.StringIO) -> None:
    answer = client.get("/api/v1/runs?limit=3", headers={"authorization": "Bearer hush"})
    (line,) = [json.loads(text) for text in logged.getvalue().splitlines() if "answered" in text]
    assert line["request"] == answer.headers["x-request-id"]
    expected = ("GET", "/api/v1/runs", 200, "local", "info", "tauscope.requests")
    assert tuple(line[name] for name in ("method", "path", "status", "caller", "level", "logger")) == expected
    assert line["timestamp"].endswith("Z")
    assert "hush" not in logged.getvalue()
    assert "limit" not in line["path"]


def test_secrets_are_hidden_wherever_they_stand(logged: io.StringIO) -> None:
    key, token = "tsk_0a1b2c3d_AbC-dEf_123", "17-abcdefghijklmnopqrstuv"
    log = logging.getLogger("tauscope.test")
    log.warning("key %s and token %s", key, token, extra={"sent": {"authorization": f"Bearer {key}"}})
    try:
        raise ValueError(f"no {key}\nsecond line")
    except ValueError:
        log.exception("failed")
    said = logged.getvalue()
    assert key not in said
    assert token not in said
    lines = [json.loads(text) for text in said.splitlines()]
    assert len(lines) == 2
    assert "second line" in lines[1]["exception"]


def test_systemd_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    address = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(address)
        listener.settimeout(10.0)
        monkeypatch.setenv("NOTIFY_SOCKET", address)
        monkeypatch.setenv("WATCHDOG_USEC", "2000")
        heard: list[bytes] = []

        async def session() -> None:
            async with readiness.notify_systemd():
                while heard.count(b"WATCHDOG=1") < 3:
                    heard.append(await asyncio.to_thread(listener.recv, 100))

        asyncio.run(session())
        listener.setblocking(False)
        while heard[-1] != b"STOPPING=1":
            heard.append(listener.recv(100))
    assert b"READY=1" in heard


@pytest.mark.parametrize("address", ["", "relative", "/nowhere/at/all"])
def test_without_systemd_nobody_is_told(address: str) -> None:
    assert not readiness.notify("READY=1", {"NOTIFY_SOCKET": address})


def test_whose_watchdog_it_is() -> None:
    assert readiness.watchdog_interval_s({"WATCHDOG_USEC": "10000000"}) == 5.0
    assert readiness.watchdog_interval_s({"WATCHDOG_USEC": "10000000", "WATCHDOG_PID": "1"}) is None
    assert readiness.watchdog_interval_s({"WATCHDOG_USEC": "x"}) is None
    assert readiness.watchdog_interval_s({}) is None
