"""Every operation with every key and without; who may do what stands here by hand, so that a new route is placed."""

import json
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest
from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from starlette.testclient import TestClient

from server.auth.keyed import make_keys
from server.conftest import connected
from server.http.contract.documented import require_documented
from server.http.problem_check import assert_problem
from server.http.write_openapi import COMMITTED
from server.queue.controls import finish_at_once
from server.queue.executors import InlineExecutor
from tauscope.server.auth.keys import Scope, find_needed_scope
from tauscope.server.http import Settings, create_app

READ, ANALYSE, MOVE, ADMIN = Scope.READ, Scope.ANALYSE, Scope.MOVE, Scope.ADMIN
V1 = "/api/v1"

CHANGING: dict[str, Scope] = {
    f"POST {V1}/stop": READ,
    f"POST {V1}/runs/{{identifier}}/stop": READ,
    f"POST {V1}/campaigns/{{identifier}}/stop": READ,
    f"POST {V1}/robots/check": ANALYSE,
    f"POST {V1}/recordings": ANALYSE,
    f"POST {V1}/robots": ANALYSE,
    f"DELETE {V1}/robots/versions/{{version}}": ADMIN,
    f"POST {V1}/mappings/check": ANALYSE,
    f"POST {V1}/identifications": ANALYSE,
    f"POST {V1}/diagnoses": ANALYSE,
    f"POST {V1}/excitations": ANALYSE,
    f"POST {V1}/rollouts": ANALYSE,
    f"DELETE {V1}/identifications/{{identifier}}": ANALYSE,
    f"DELETE {V1}/diagnoses/{{identifier}}": ANALYSE,
    f"DELETE {V1}/excitations/{{identifier}}": ANALYSE,
    f"DELETE {V1}/rollouts/{{identifier}}": ANALYSE,
    f"POST {V1}/events/{{number}}/acknowledge": ANALYSE,
    f"POST {V1}/schedules/{{name}}/run": MOVE,
    f"POST {V1}/models/{{identifier}}/activate": ADMIN,
    f"POST {V1}/models/{{identifier}}/make-reference": ADMIN,
    f"PUT {V1}/model-policy": ADMIN,
    f"PUT {V1}/schedules/{{name}}": ADMIN,
    f"DELETE {V1}/schedules/{{name}}": ADMIN,
    f"POST {V1}/runs": MOVE,
    f"POST {V1}/campaigns": MOVE,
    f"POST {V1}/leases": MOVE,
    f"POST {V1}/leases/{{identifier}}/heartbeat": MOVE,
    f"POST {V1}/leases/{{identifier}}/arm": MOVE,
    f"POST {V1}/leases/{{identifier}}/disarm": MOVE,
    f"DELETE {V1}/leases/{{identifier}}": MOVE,
    f"DELETE {V1}/recordings/{{name}}": ADMIN,
    f"DELETE {V1}/runs/{{identifier}}": ADMIN,
    f"DELETE {V1}/campaigns/{{identifier}}": ADMIN,
}
OPEN: set[str] = {"GET /healthz", "GET /readyz"}
"""What anybody may ask, pages and the document itself apart."""


UNDOCUMENTED: set[str] = {
    "GET /",
    "GET /docs",
    "GET /docs/errors/{code}",
    "GET /docs/how-to/{name}",
    "GET /docs/pages.css",
    "GET /docs/schemas/{name}",
    "GET /example/{name}",
    "GET /openapi.json",
    "GET /page/{name}",
}
"""Routes for people and programs of other kinds; nothing but reading."""


@cache
def documented_paths() -> dict[str, Any]:
    return json.loads(COMMITTED.read_text(encoding="utf-8"))["paths"]


def operations() -> list[str]:
    paths = documented_paths()
    return sorted(f"{method.upper()} {path}" for path, methods in paths.items() for method in methods)


def expected_scope(operation: str) -> Scope | None:
    if operation.startswith("GET "):
        return None if operation in OPEN else READ
    return CHANGING[operation]


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestClient, dict[Scope, str]]]:
    settings = Settings(data_folder=tmp_path_factory.mktemp("service") / "data", requests_per_s=1e6)
    keys = make_keys(settings.data_folder)
    app = create_app(settings, InlineExecutor(), finish_at_once)
    with connected(app) as client:
        yield client, keys


def application(client: TestClient) -> FastAPI:
    assert isinstance(client.app, FastAPI)
    return client.app


def test_every_operation_that_changes_something_is_placed() -> None:
    assert {operation for operation in operations() if not operation.startswith("GET ")} == set(CHANGING)


@pytest.mark.parametrize("key", [None, *Scope], ids=["none", *Scope])
@pytest.mark.parametrize("operation", operations())
def test_who_may_do_what(operation: str, key: Scope | None, service: tuple[TestClient, dict[Scope, str]]) -> None:
    client, keys = service
    access = application(client).state.services.access
    needed = expected_scope(operation)
    method, path = operation.split(" ")
    address = re.sub(r"\{format\}", "json", re.sub(r"\{(identifier|name|number|[a-z_]+)\}", "nothing", path))
    access.failures.take("-")  # the bucket of an address of its own
    access.failures._buckets.clear()
    answer = client.request(method, address, headers={} if key is None else {"authorization": f"Bearer {keys[key]}"})
    if needed is None or (key is not None and list(Scope).index(key) >= list(Scope).index(needed)):
        assert answer.status_code != 401
        assert "forbidden" not in answer.text
        assert answer.status_code < 500, answer.text
        require_documented(method, path, answer.status_code, answer.content)
    elif key is None:
        assert_problem(answer, "unauthorized", 401)
    else:
        assert_problem(answer, "forbidden", 403)


@pytest.mark.parametrize(
    "request_line",
    ["PUT /api/v1/runs", "PATCH /api/v1/runs/x", "POST /api/v1/new", "POST /api/v1/runs/x/y", "DELETE /api/v1/runs",
     "POST /api/v1/stop/x", "POST /api/v1/runs//stop", "POST /healthz", "DELETE /docs", "TRACE /api/v1/runs",
     "POST /api/v1/runs/x/stop/", "POST /api/v1/Runs"],
)  # fmt: skip
def test_what_nobody_has_placed_needs_the_highest_scope(request_line: str) -> None:
    assert find_needed_scope(*request_line.split(" ")) is ADMIN


@pytest.mark.parametrize("path", ["/api/v1/nothing", "/api/", "/api/v2/runs", "/metrics"])
def test_what_nobody_has_placed_is_not_read_without_a_key(path: str) -> None:
    assert find_needed_scope("GET", path) is READ


def test_the_document_says_which_scope_is_needed() -> None:
    paths = documented_paths()
    for operation in operations():
        method, path = operation.split(" ")
        stated = paths[path][method.lower()].get("x-tauscope-scope")
        assert stated == (expected_scope(operation) and str(expected_scope(operation)))


def test_every_route_is_in_the_document_or_only_shows_something(service: tuple[TestClient, dict[Scope, str]]) -> None:
    """What is in no document would be in none of these tests."""
    client, _ = service
    routes = list(iter_route_contexts(application(client).routes))
    found = {f"{method} {route.path}" for route in routes for method in (route.methods or {"ANY"}) - {"HEAD"}}
    assert found - set(operations()) == UNDOCUMENTED
    assert set(operations()) <= found
