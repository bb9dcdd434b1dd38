"""What stands before every route: hosts, origins, headers, unforeseen failures; and the settings."""

import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from pydantic import ValidationError
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, connected
from server.http.problem_check import assert_problem
from server.queue.executors import InlineExecutor
from tauscope.errors import TauscopeError
from tauscope.server.auth.keys import KeyFile, Scope
from tauscope.server.http import Settings, create_app, default_data_folder, serve
from tauscope.server.http.protection import HEADERS
from tauscope.server.http.services import require_data_folder
from tauscope.server.store.data_folder import ItemStore


@pytest.fixture
def settings(module_settings: Settings) -> Settings:
    return module_settings


@pytest.fixture
def client(module_client: TestClient) -> TestClient:
    return module_client


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.1:8000", "localhost", "LOCALHOST:1", "[::1]", "[::1]:8000"])
def test_own_hosts(host: str, client: TestClient) -> None:
    assert client.get("/healthz", headers={"host": host}).status_code == 200


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8000", "127.0.0.1.evil.example", "localhost.evil.example", "evil.example@localhost",
     "localhost@evil.example", "127.0.0.1/x", "", "[::2]", "[", "127.0.0.1:x", "127.0.0.1:99999", "0.0.0.0",
     "localhost,evil"],
)  # fmt: skip
def test_other_hosts_are_turned_away(host: str, client: TestClient) -> None:
    assert_problem(client.get("/healthz", headers={"host": host}), "host", 400)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"origin": "http://127.0.0.1:8000"}, 200),
        ({"origin": "http://127.0.0.1:8000", "sec-fetch-site": "same-origin"}, 200),
        ({"sec-fetch-site": "none"}, 200),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "http://127.0.0.1:3000"}, 403),
        ({"origin": "null"}, 403),
        ({"sec-fetch-site": "cross-site"}, 403),
        ({"sec-fetch-site": "same-site"}, 403),
    ],
)
def test_pages_of_other_origins_are_turned_away(headers: dict[str, str], status: int, client: TestClient) -> None:
    answer = client.get(IDENTIFICATIONS, headers=headers)
    assert answer.status_code == status
    assert "access-control-allow-origin" not in answer.headers
    if status == 403:
        assert_problem(answer, "origin", 403)


def test_a_preflight_request_is_not_granted(client: TestClient) -> None:
    headers = {"origin": "http://evil.example", "access-control-request-method": "POST"}
    assert_problem(client.options(IDENTIFICATIONS, headers=headers), "origin", 403)


@pytest.mark.parametrize(
    "path", ["/healthz", "/docs", "/openapi.json", IDENTIFICATIONS, "/nothing", "/docs/errors/internal"]
)
def test_every_answer_has_safe_headers(path: str, client: TestClient) -> None:
    answer = client.get(path)
    assert {name: answer.headers[name] for name in HEADERS} == dict(HEADERS)


def test_health(client: TestClient) -> None:
    health = client.get("/healthz").json()
    assert health["status"] == "ok"
    assert set(health) == {"status", "version"}


def test_unknown_places_and_methods(client: TestClient) -> None:
    assert_problem(client.get("/api/v1/nothing"), "not-found", 404)
    assert_problem(client.get("/api/v2/identifications"), "not-found", 404)
    answer = client.put(IDENTIFICATIONS)
    assert_problem(answer, "method-not-allowed", 405)
    assert answer.headers["allow"]


@pytest.mark.parametrize(
    "error", [KeyError("secret"), LookupError("secret"), ValueError("secret"), OSError(5, "secret")]
)
def test_a_fault_of_our_own_is_500_and_tells_nothing(
    error: Exception, client: TestClient, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(_: ItemStore) -> None:
        raise error

    monkeypatch.setattr(ItemStore, "identifiers", fail)
    answer = client.get(IDENTIFICATIONS)
    assert_problem(answer, "internal", 500)
    assert "secret" not in answer.text
    assert "secret" in caplog.text


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.9.10", "localhost", "::1", "[::1]"])
def test_loopback_needs_no_key(host: str, tmp_path: Path) -> None:
    require_data_folder(Settings(data_folder=tmp_path, host=host))


OTHERS = ["0.0.0.0", "::", "192.168.1.5", "arm-lab.example", "", "127.0.0.1.evil.example", "*"]


@pytest.mark.parametrize("host", OTHERS)
def test_other_addresses_are_refused_without_a_key(host: str, tmp_path: Path) -> None:
    settings = Settings(data_folder=tmp_path, host=host)
    for begin in (lambda: require_data_folder(settings), lambda: serve(settings, lambda _: pytest.fail("it listens"))):
        with pytest.raises(TauscopeError, match="others could reach it") as raised:
            begin()
        assert "\n" not in str(raised.value)
    now = datetime.now(UTC)
    KeyFile(tmp_path).add("expired", Scope.ADMIN, now - timedelta(days=2), timedelta(days=1))
    KeyFile(tmp_path).add("revoked", Scope.ADMIN, now, None)
    KeyFile(tmp_path).revoke("revoked", now)
    with pytest.raises(TauscopeError, match="no valid API key"):
        require_data_folder(settings)
    KeyFile(tmp_path).add("valid", Scope.READ, now, None)
    require_data_folder(settings)


def test_hosts_of_a_service_that_others_can_reach(tmp_path: Path) -> None:
    settings = Settings(data_folder=tmp_path, host="0.0.0.0", names=("Arm-Lab.example",))
    assert all(settings.answers_for(name) for name in ("arm-lab.example", "localhost", "192.168.1.5", "2001:db8::1"))
    assert not any(settings.answers_for(name) for name in ("evil.example", "192.168.1.5.evil.example", "", None))


@pytest.mark.parametrize(
    ("certificate", "key", "reason"),
    [("c.pem", None, "belong together"), (None, "k.pem", "belong together"), ("c.pem", "k.pem", "no usable")],
)
def test_a_certificate_that_cannot_be_used(
    certificate: str | None, key: str | None, reason: str, tmp_path: Path
) -> None:
    for name in ("c.pem", "k.pem"):
        (tmp_path / name).write_text("nothing")
    files = {"tls_certificate": certificate and tmp_path / certificate, "tls_key": key and tmp_path / key}
    settings = Settings.model_validate({"data_folder": tmp_path, "port": 0, **files})
    with pytest.raises(TauscopeError, match=reason):
        serve(settings, lambda _: pytest.fail("it listens"))


def test_pages_bring_nothing_inline(client: TestClient) -> None:
    for path in ("/docs", "/docs/errors/internal"):
        answer = client.get(path)
        assert not re.search(r"<style|<script|\sstyle=|\son[a-z]+=|javascript:", answer.text)
        policy = answer.headers["content-security-policy"]
        assert "unsafe" not in policy
        assert "default-src 'none'" in policy
    sheet = client.get("/docs/pages.css")
    assert sheet.headers["content-type"].startswith("text/css")
    assert "/docs/pages.css" in client.get("/docs").text


def test_settings_are_checked(tmp_path: Path) -> None:
    for wrong in ({"workers": 0}, {"port": 70000}, {"max_upload_bytes": 0}, {"cors": "*"}):
        with pytest.raises(ValidationError):
            Settings.model_validate({"data_folder": tmp_path, **wrong})


def test_the_folder_where_none_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert default_data_folder() == tmp_path / "tauscope"
    monkeypatch.setenv("XDG_DATA_HOME", "relative")
    assert default_data_folder() == Path.home() / ".local" / "share" / "tauscope"


def test_a_second_service_in_the_same_folder_is_refused(client: TestClient, settings: Settings) -> None:
    with (
        pytest.raises(TauscopeError, match="another tauscope service"),
        connected(create_app(settings, InlineExecutor())),
    ):
        pass
