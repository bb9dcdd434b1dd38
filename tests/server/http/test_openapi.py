"""The interface: committed, complete, with examples, and its pages."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

import tauscope.errors
from server.http import write_openapi
from server.http.problem_check import assert_problem
from server.http.write_openapi import COMMITTED, document_text
from tauscope.errors import TauscopeError
from tauscope.server.http.openapi import resolve_reference
from tauscope.server.problems import KINDS
from tauscope.server.queue.queue import CANCELLED, INTERNAL, INTERRUPTED, WORKER_LOST


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return json.loads(document_text())


def operations(document: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    return [
        (f"{method.upper()} {path}", operation)
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]


def test_the_committed_document_is_the_present_one() -> None:
    hint = (
        "the interface changed: raise API_VERSION in service/tauscope/server/http/app.py,"
        " run `python tests/server/http/write_openapi.py`, and note it in CHANGELOG.md"
    )
    assert COMMITTED.read_text(encoding="utf-8") == document_text(), hint


def test_a_changed_document_has_a_version_of_its_own(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    text = COMMITTED.read_text(encoding="utf-8")
    version = json.loads(text)["info"]["version"]
    assert write_openapi.known_versions()[version] == write_openapi.document_hash(text)
    monkeypatch.setattr(write_openapi, "COMMITTED", tmp_path / "openapi.json")
    monkeypatch.setattr(write_openapi, "VERSIONS", tmp_path / "versions.json")
    (tmp_path / "versions.json").write_text(json.dumps({version: write_openapi.document_hash(text)}))
    assert write_openapi.write(amend=False) is None
    monkeypatch.setattr(write_openapi, "document_text", lambda: text.replace("Tauscope", "Otherscope"))
    assert "raise API_VERSION" in str(write_openapi.write(amend=False))
    assert (tmp_path / "openapi.json").read_text(encoding="utf-8") == text
    assert write_openapi.write(amend=True) is None


def test_the_document_is_served(client: TestClient, document: dict[str, Any]) -> None:
    assert client.get("/openapi.json").json() == document


def test_every_reference_leads_somewhere(document: dict[str, Any]) -> None:
    references = set(re.findall(r'"\$ref": "(#/components/[^"]+)"', json.dumps(document)))
    for reference in references:
        resolve_reference(document, {"$ref": reference})  # KeyError: it leads nowhere
    parts = {f"#/components/{kind}/{name}" for kind, found in document["components"].items() for name in found}
    assert parts - references == {"#/components/securitySchemes/key"}
    assert not {"HTTPValidationError", "ValidationError"} & set(document["components"]["schemas"])


def test_every_schema_has_an_address_of_its_own(client: TestClient, document: dict[str, Any]) -> None:
    """The document leaves out formats of files, and words on answers: these addresses have both."""
    addresses = set(re.findall(r'"/docs/schemas/(\w+)"', json.dumps(document)))
    assert {"IdentificationDocument", "DiagnosisDocument", "TrajectoryDocument"} <= addresses
    open_, seen = addresses | {"RunAnswer", "DiagnosisRequest"}, set[str]()
    while open_:
        name = open_.pop()
        answer = client.get(f"/docs/schemas/{name}")
        assert answer.status_code == 200, name
        assert answer.headers["content-type"].startswith("application/schema+json")
        for each in answer.json().get("properties", {}).values():
            assert each["description"], name
        seen.add(name)
        open_ |= set(re.findall(r'"\$ref": "([^"]+)"', answer.text)) - seen
    assert len(seen) > len(addresses)
    problem = assert_problem(client.get("/docs/schemas/DiagnosisDocumen"), "not-found", 404)
    assert "DiagnosisDocument" in problem["detail"]


def test_every_operation_says_what_it_does_and_which_problems_it_has(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        assert operation["summary"], name
        assert operation["description"], name
        for status, reference in operation["responses"].items():
            answer = resolve_reference(document, reference)
            assert answer["description"], (name, status)
            if status == "default" or int(status) >= 400:
                (media_type,) = answer["content"]
                assert media_type == "application/problem+json", (name, status)
                examples = answer["content"][media_type]["examples"].values()
                assert all(resolve_reference(document, example)["value"]["code"] for example in examples), (
                    name,
                    status,
                )
                assert examples, (name, status)


def test_every_body_is_strict_and_has_an_example(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        body = operation.get("requestBody")
        if name.startswith("POST"):
            assert body is not None, name
        for media_type, content in (body or {"content": {}})["content"].items():
            if media_type == "application/json":
                assert content["examples"], name
    for name, schema in document["components"]["schemas"].items():
        if schema.get("type") == "object":
            assert schema["additionalProperties"] is False, name


def test_the_examples_are_accepted(client: TestClient, document: dict[str, Any], tmp_path: Path) -> None:
    body = document["paths"]["/api/v1/identifications"]["post"]["requestBody"]["content"]["application/json"]
    for day in ("monday.csv", "tuesday.csv", "wednesday.mcap"):
        client.post("/api/v1/recordings", files={"file": (day, day.encode())})
    for example in body["examples"].values():
        assert client.post("/api/v1/identifications", json=example["value"]).status_code == 202
    check = document["paths"]["/api/v1/robots/check"]["post"]["requestBody"]["content"]["application/json"]
    for example in check["examples"].values():
        assert client.post("/api/v1/robots/check", json=example["value"]).status_code == 200


def test_every_code_has_a_kind_and_a_page(client: TestClient) -> None:
    errors = [
        error
        for error in vars(tauscope.errors).values()
        if isinstance(error, type) and issubclass(error, TauscopeError)
    ]
    codes = {error.code for error in errors if error is not TauscopeError}
    assert codes <= set(KINDS)
    assert {problem.code for problem in (CANCELLED, INTERNAL, INTERRUPTED, WORKER_LOST)} <= set(KINDS)
    for code in KINDS:
        page = client.get(f"/docs/errors/{code}")
        assert page.status_code == 200
        assert code in page.text
    assert_problem(client.get("/docs/errors/nothing"), "not-found", 404)


def test_the_page_shows_every_operation_and_needs_nothing_from_elsewhere(
    client: TestClient, document: dict[str, Any]
) -> None:
    page = client.get("/docs")
    assert page.headers["content-type"].startswith("text/html")
    for name, operation in operations(document):
        assert name in page.text
        assert operation["summary"] in page.text
    assert "<script" not in page.text
    assert not re.search(r"(?:src|href)=\"?(?:https?:)?//", page.text)
