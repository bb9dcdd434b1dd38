"""Every POST of the document: with an Idempotency-Key it is done once, or it stands here why that is not needed."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import RECORDINGS, connected
from server.http.motions import ROBOT, move_document
from server.http.problem_check import assert_problem
from server.http.write_openapi import COMMITTED
from server.queue.controls import finish_at_once
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked
from tauscope.server.http import Settings, create_app
from tauscope.server.http.openapi import resolve_reference
from tauscope.server.http.repeated_requests import is_repeatable

V1 = "/api/v1"
CHECK = f"{V1}/robots/check"
STOPS_AGAIN = "a second stop is welcome"
SET_AGAIN = "what is set already is set again"
NOT_NEEDED: dict[str, str] = {
    f"{V1}/stop": STOPS_AGAIN,
    f"{V1}/runs/{{identifier}}/stop": STOPS_AGAIN,
    f"{V1}/campaigns/{{identifier}}/stop": STOPS_AGAIN,
    f"{V1}/leases": "exclusive, and ends by itself",
    f"{V1}/mappings/check": "keeps nothing",
    f"{V1}/events/{{number}}/acknowledge": "an event that is closed stays as it was closed",
    f"{V1}/models/{{identifier}}/activate": SET_AGAIN,
    f"{V1}/models/{{identifier}}/make-reference": SET_AGAIN,
    f"{V1}/leases/{{identifier}}/heartbeat": SET_AGAIN,
    f"{V1}/leases/{{identifier}}/arm": SET_AGAIN,
    f"{V1}/leases/{{identifier}}/disarm": SET_AGAIN,
}
SNAPSHOT_JOB = {"recordings": ["monday.csv"], "held_out": ["tuesday.csv"]}
REQUESTS: dict[str, dict[str, Any]] = {
    f"{V1}/runs": {"json": {"robot": ROBOT, "trajectory": move_document()}},
    f"{V1}/campaigns": {"json": {"robot": ROBOT}},
    f"{V1}/excitations": {"json": {"robot": ROBOT}},
    f"{V1}/identifications": {"json": {"robot": ROBOT, **SNAPSHOT_JOB}},
    f"{V1}/diagnoses": {"json": {"robot": ROBOT, **SNAPSHOT_JOB}},
    f"{V1}/rollouts": {"json": {"robot": ROBOT, "recordings": ["monday.csv"]}},
    RECORDINGS: {"files": {"file": ("new.csv", b"t,q1,tau1\n")}},
    f"{V1}/robots": {"json": {"robot": ROBOT}},
    CHECK: {"json": {"robot": ROBOT}},
    f"{V1}/schedules/{{name}}/run": {"json": {"reason": "a test"}},
}
"""A request that does something, for each that is done once."""


def posts() -> dict[str, dict[str, Any]]:
    paths = json.loads(COMMITTED.read_text(encoding="utf-8"))["paths"]
    return {path: methods["post"] for path, methods in paths.items() if "post" in methods}


class IdleExecutor(InlineExecutor):
    """Does nothing of what it is given: what is asked here is the interface, not the work."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Any:
        return super().submit(lambda: None)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return unpacked(SNAPSHOTS[-1], tmp_path)


@pytest.fixture
def client(folder: Path) -> Iterator[TestClient]:
    """A service that has something to repeat."""
    settings = Settings(data_folder=folder, fires_schedules=False)
    with connected(create_app(settings, IdleExecutor(), finish_at_once)) as client:
        query = {"kind": "identification", "state": "succeeded"}
        like = client.get(f"{V1}/items", params=query).json()["items"][-1]["id"]
        recordings = {"pattern": "*day.csv", "train": 1, "held_out": 1}
        definition = {"kind": "identification", "every_s": 3600, "recordings": recordings}
        assert client.put(f"{V1}/schedules/nightly", json={"like": like, "definition": definition}).status_code == 200
        yield client


def test_every_post_is_done_once_or_needs_not_to_be() -> None:
    document = json.loads(COMMITTED.read_text(encoding="utf-8"))
    assert set(posts()) == set(REQUESTS) | set(NOT_NEEDED)
    for path, operation in posts().items():
        parameters = [resolve_reference(document, each) for each in operation.get("parameters", ())]
        headers = [each["name"] for each in parameters if each["in"] == "header"]
        assert ("Idempotency-Key" in headers) is is_repeatable(path) is (path in REQUESTS), path
        if path in REQUESTS:
            for status, code in (("409", "not-repeatable"), ("422", "key-reused"), ("507", "storage-full")):
                answer = resolve_reference(
                    document, operation["responses"].get(status, operation["responses"]["default"])
                )
                assert code in answer["content"]["application/problem+json"]["examples"], path


@pytest.mark.parametrize("path", REQUESTS)
def test_it_is_done_once(path: str, client: TestClient, folder: Path) -> None:
    made = {f"{V1}/schedules/{{name}}/run": "identifications", CHECK: "robots"}.get(path, path.removeprefix(f"{V1}/"))
    address, request = path.replace("{name}", "nightly"), REQUESTS[path]
    client.headers["Idempotency-Key"] = "9d1c-once"
    before = entries(made, client, folder)
    first, second = (client.post(address, **request) for _ in range(2))
    assert first.is_success, first.text
    assert (second.status_code, second.content) == (first.status_code, first.content)
    assert second.headers["idempotency-replayed"] == "true"
    assert entries(made, client, folder) == before + (path != CHECK)  # a check keeps nothing
    other: dict[str, Any] = {"json": {"reason": "another"}}
    if "files" in request:
        other = {"files": {"file": ("other.csv", b"t\n")}}
    assert_problem(client.post(address, **other), "key-reused", 422)


def entries(kind: str, client: TestClient, folder: Path) -> int:
    """How many things of a kind are kept: in a folder, but for leases, which nobody writes down."""
    if kind == "leases":
        return len(client.get(f"{V1}/leases").json()["leases"])
    return len([path for path in (folder / kind).iterdir() if not path.name.startswith(".")])
