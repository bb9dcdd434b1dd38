"""The OpenAPI document as openapi-python-client 0.29 reads it, which is in no list of ours: what it warns of is lost.

By hand: `openapi-python-client generate --path tests/server/http/openapi.json` gives no warning.
"""

from collections.abc import Iterator
from typing import Any

import pytest

from server.http.contract.documented import load_document
from tauscope.server.http.openapi import resolve_reference

BYTES = "application/octet-stream"


def walk(node: Any) -> Iterator[dict[str, Any]]:
    """Every object within a part of the document."""
    if isinstance(node, dict):
        yield node
    for each in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from walk(each)


def operations() -> list[dict[str, Any]]:
    return [operation for known in load_document()["paths"].values() for operation in known.values()]


def contents(operation: dict[str, Any]) -> list[dict[str, Any]]:
    """Contents of the answers of an operation that are no problems."""
    return [answer["content"] for answer in operation["responses"].values() if "content" in answer]


def test_no_alternative_has_an_object_for_a_default() -> None:
    """An operation whose body has one is left out."""
    schemas = load_document()["components"]["schemas"]
    assert not [node for node in walk(schemas) if "anyOf" in node and isinstance(node.get("default"), dict)]


@pytest.mark.parametrize("operation", operations(), ids=lambda operation: operation["operationId"])
def test_answers_are_read_by_their_first_type(operation: dict[str, Any]) -> None:
    """Others than the first are not looked at: bytes hold every file, text every one but bytes."""
    for content in contents(operation):
        first, *others = content
        assert first in ("application/json", BYTES) or first.startswith("text/"), first
        assert not others or first != "application/json"
        assert first == BYTES or BYTES not in others


def test_files_are_sent_as_files() -> None:
    """Without the format they are sent as text without a name, which the service refuses."""
    forms = [operation["requestBody"]["content"] for operation in operations() if "requestBody" in operation]
    parts = [node for node in walk(forms) if node.get("contentMediaType") == BYTES]
    assert parts
    assert all(part["format"] == "binary" for part in parts)


def test_an_operation_of_several_bodies_has_an_optional_parameter() -> None:
    """The generated function calls its body optional: it imports `Unset` for that where a parameter is optional too."""
    document = load_document()
    several = [each for each in operations() if len(each.get("requestBody", {}).get("content", ())) > 1]
    assert {"check_robot_file", "keep_robot_version"} <= {each["operationId"] for each in several}
    for operation in several:
        parameters = [resolve_reference(document, each) for each in operation.get("parameters", [])]
        assert any(not each.get("required", False) for each in parameters), operation["operationId"]
