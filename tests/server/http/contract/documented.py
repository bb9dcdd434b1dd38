"""Answers as the OpenAPI document states them: a status, and of a problem its code."""

import json
from functools import cache
from typing import Any

from server.http.write_openapi import COMMITTED
from tauscope.server.http.openapi import resolve_reference
from tauscope.server.problems import MEDIA_TYPE


@cache
def load_document() -> dict[str, Any]:
    return json.loads(COMMITTED.read_text(encoding="utf-8"))


def list_problems(operation: dict[str, Any], status: str) -> set[str]:
    """Codes of the problems that an operation states of a status."""
    answer = resolve_reference(load_document(), operation["responses"][status])
    return set(answer["content"][MEDIA_TYPE]["examples"])


def require_documented(method: str, path: str, status: int, content: bytes) -> None:
    """Hold status and problem of an answer against the operation; `default` stands for statuses of problems alone."""
    operation = load_document()["paths"][path][method.lower()]
    stated = str(status) if str(status) in operation["responses"] else "default"
    assert stated != "default" or (status >= 400 and stated in operation["responses"]), (method, path, status, content)
    if status >= 400:
        code = json.loads(content)["code"]
        assert code in list_problems(operation, stated), (method, path, status, code)
