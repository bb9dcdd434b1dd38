"""Requests that are not as documented: unknown query parameters are refused, wrong methods are told the right ones."""

import json
import re
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from server.http.motions import QUICK_DESIGN, ROBOT
from server.http.problem_check import assert_problem

DOCUMENT = json.loads((Path(__file__).parents[1] / "openapi.json").read_text(encoding="utf-8"))
METHODS = ("GET", "POST", "PUT", "DELETE", "PATCH")
PATHS = {path: {method.upper() for method in known} for path, known in DOCUMENT["paths"].items()}


@pytest.mark.parametrize("path", sorted(PATHS))
def test_allow_names_every_method_of_an_address(path: str, module_client: TestClient) -> None:
    address = re.sub(r"\{[^}]+\}", "x", path)
    wrong = next(method for method in METHODS if method not in PATHS[path])
    answer = module_client.request(wrong, address)
    assert_problem(answer, "method-not-allowed", 405)
    assert set(answer.headers["allow"].split(", ")) == PATHS[path]


def test_an_unknown_query_parameter_is_refused(module_client: TestClient) -> None:
    problem = assert_problem(module_client.get("/api/v1/items?stat=failed"), "invalid-request", 422)
    assert problem["detail"] == "query parameter 'stat' is not known here; did you mean 'state'?"
    assert problem["errors"] == [{"field": "query.stat", "message": "not known here"}]
    problem = assert_problem(module_client.get("/api/v1/leases?all=1"), "invalid-request", 422)
    assert "this address takes none" in problem["detail"]


def test_a_stop_is_never_refused_for_its_query(module_client: TestClient) -> None:
    assert module_client.post("/api/v1/stop?all=1").is_success


def test_operations_have_names_of_their_own() -> None:
    """Functions of generated clients are called so."""
    names = [operation["operationId"] for known in DOCUMENT["paths"].values() for operation in known.values()]
    assert len(set(names)) == len(names)


def test_the_document_is_short() -> None:
    """As it is sent: 266 kB while it held the formats of files, the words on answers, and parts twice."""
    assert len(json.dumps(DOCUMENT, separators=(",", ":"))) <= 150_000


def test_lists_are_read_page_by_page(client: TestClient) -> None:
    for number in range(5):
        client.post("/api/v1/recordings", files={"file": (f"{number}.csv", b"t\n%d\n" % number)})
        client.post("/api/v1/excitations", json={"robot": ROBOT, "options": QUICK_DESIGN})
    for plural, key in (("recordings", "name"), ("excitations", "id")):
        whole = [each[key] for each in client.get(f"/api/v1/{plural}").json()[plural]]
        assert len(whole) == 5
        found, after = [], None
        for length in (2, 2, 1):
            page = client.get(f"/api/v1/{plural}", params={"limit": 2} | ({"after": after} if after else {})).json()
            assert len(page[plural]) == length
            found += [each[key] for each in page[plural]]
            after = page["next"]
        assert (found, after) == (whole, None)
