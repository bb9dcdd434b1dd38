"""Forms of any bytes: always an answer, never a file outside, never a file left behind."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as examples
from hypothesis import strategies as st
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS, connected
from server.queue.executors import ManualExecutor
from tauscope.server.http import Settings, create_app
from tauscope.server.store.files import is_file_name


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("forms")


@pytest.fixture(scope="module")
def form_client(folder: Path) -> Iterator[TestClient]:
    settings = Settings(
        data_folder=folder / "data", max_upload_bytes=2000, max_document_bytes=500, max_recordings=2, max_waiting=10_000
    )
    with connected(create_app(settings, ManualExecutor())) as client:
        yield client


FRAGMENTS = st.sampled_from(
    [
        b"--b\r\n", b"--b--\r\n", b"--b--", b"\r\n", b"\r\n\r\n", b"--", b"Content-Disposition: form-data; ",
        b'name="file"', b'name="robot"', b'name="recordings"', b'name="request"', b'; filename="a.csv"',
        b'; filename=""', b'; filename="../../escaped"', b"; filename*=UTF-8''..%2f", b"Content-Type: text/csv\r\n",
        b"Content-Transfer-Encoding: base64\r\n", b"{}", b'{"recordings": []}', b"t,q1,tau1\n", b"\0", b"\xff\xfe",
        b"x" * 600,
    ]
)  # fmt: skip
NAMES = st.text(st.characters(exclude_categories=["Cs"], exclude_characters='"\r\n\\'), max_size=20)


@given(
    pieces=st.lists(FRAGMENTS, max_size=25), path=st.sampled_from([RECORDINGS, IDENTIFICATIONS, "/api/v1/robots/check"])
)
@examples(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_form_is_answered(pieces: list[bytes], path: str, form_client: TestClient, folder: Path) -> None:
    headers = {"content-type": "multipart/form-data; boundary=b"}
    answer = form_client.post(path, content=b"".join(pieces), headers=headers)
    assert answer.status_code in (200, 201, 202, 400, 409, 413, 415, 422), answer.text
    if answer.status_code >= 400:
        assert answer.headers["content-type"] == "application/problem+json"
    assert [entry.name for entry in folder.iterdir()] == ["data"]
    leftovers = [entry.name for entry in folder.rglob(".*") if entry.name not in (".lock", ".sha256")]
    assert leftovers == []


@given(name=NAMES, content=st.binary(max_size=50))
@examples(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_is_kept_under_its_own_name_or_not_at_all(
    name: str, content: bytes, form_client: TestClient, folder: Path
) -> None:
    body = (
        f'--b\r\nContent-Disposition: form-data; name="file"; filename="{name}"\r\n\r\n'.encode()
        + content
        + b"\r\n--b--\r\n"
    )
    form_client.delete(f"{RECORDINGS}/{name}") if is_file_name(name) else None
    answer = form_client.post(RECORDINGS, content=body, headers={"content-type": "multipart/form-data; boundary=b"})
    assert answer.status_code == (201 if is_file_name(name) else 422), answer.text
    if is_file_name(name):
        assert (folder / "data" / "recordings" / name).read_bytes() == content
        assert answer.json()["size"] == len(content)
