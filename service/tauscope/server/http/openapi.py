"""The OpenAPI document: bodies that the framework does not see, and models that only they refer to."""

from collections.abc import Mapping, Sequence
from functools import reduce
from operator import getitem
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from tauscope.server.auth.audited_requests import is_audited
from tauscope.server.auth.scopes import find_needed_scope, is_stop
from tauscope.server.http.repeated_requests import HEADER as ONCE
from tauscope.server.http.repeated_requests import LONGEST_KEY, is_repeatable
from tauscope.server.problems import MEDIA_TYPE, problem_responses

_REFERENCE = "#/components/schemas/{model}"

Examples = Mapping[str, tuple[str, Any]]
"""For each example its summary and its value."""


def json_body(model: type[BaseModel], examples: Examples) -> dict[str, Any]:
    """A JSON body of an operation.

    Parameters
    ----------
    examples : mapping of str to (str, plain data)
        summary and value by name
    """
    shown = {name: {"summary": summary, "value": value} for name, (summary, value) in examples.items()}
    return {"application/json": {"schema": model_reference(model), "examples": shown}}


def form_body(
    parts: Mapping[str, Any], required: Sequence[str], encoding: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """A multipart body of an operation."""
    schema = {"type": "object", "properties": dict(parts), "additionalProperties": False}
    if required:
        schema["required"] = list(required)
    return {"multipart/form-data": {"schema": schema, **({"encoding": dict(encoding)} if encoding else {})}}


def binary_part(description: str) -> dict[str, Any]:
    """The schema of a file in a form."""
    return {"type": "string", "contentMediaType": "application/octet-stream", "description": description}


def binary_parts(description: str) -> dict[str, Any]:
    """The schema of several files in a form."""
    item = {"type": "string", "contentMediaType": "application/octet-stream"}
    return {"type": "array", "items": item, "description": description}


def model_reference(model: type[BaseModel]) -> dict[str, str]:
    """A reference to a model of the document."""
    return {"$ref": _REFERENCE.format(model=model.__name__)}


def resolve_reference(document: Mapping[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    """A part of a document, or that to which it refers."""
    while "$ref" in node:
        _, *steps = node["$ref"].split("/")
        node = reduce(getitem, steps, document)
    return node


def install_openapi(app: FastAPI, models: Sequence[type[BaseModel]]) -> None:
    """Have the application's OpenAPI document hold further models."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = _document(app, models)
        return app.openapi_schema

    app.openapi = document


def _document(app: FastAPI, models: Sequence[type[BaseModel]]) -> dict[str, Any]:
    """The document with all models, sorted so that it changes only where the interface does."""
    document = get_openapi(
        title=app.title, version=app.version, summary=app.summary, description=app.description, routes=app.routes
    )
    _, definitions = models_json_schema([(model, "validation") for model in models], ref_template=_REFERENCE)
    components = document.setdefault("components", {}).setdefault("schemas", {})
    components.update(definitions.get("$defs", {}))
    _add_common_answers(document)
    # The framework's own form of validation errors is never sent.
    for unused in ("HTTPValidationError", "ValidationError"):
        components.pop(unused, None)
    document["components"]["schemas"] = dict(sorted(components.items()))
    _share_problems(document)
    return document


def _share_problems(document: dict[str, Any]) -> None:
    """Put each problem's example, and each set of problems, into the document once."""
    examples: dict[str, Any] = {}
    shared: dict[str, Any] = {}
    for operations in document["paths"].values():
        for operation in operations.values():
            for status, answer in operation["responses"].items():
                problems = answer.get("content", {}).get(MEDIA_TYPE, {}).get("examples")
                if problems is None:
                    continue
                examples |= problems
                name = f"problem-{status}-{'-or-'.join(sorted(problems))}"
                references = {code: {"$ref": f"#/components/examples/{code}"} for code in problems}
                shared[name] = {
                    **answer,
                    "content": {MEDIA_TYPE: {**answer["content"][MEDIA_TYPE], "examples": references}},
                }
                operation["responses"][status] = {"$ref": f"#/components/responses/{name}"}
    document["components"] |= {"examples": dict(sorted(examples.items())), "responses": dict(sorted(shared.items()))}


_COMMON = ("bad-request", "host", "origin", "unauthorized", "forbidden", "rate-limited", "internal")
"""Problems that any request to the interface may meet, before its route or in it."""

_REPEATED = ("invalid-request", "not-repeatable", "key-reused")
"""Further problems of a request that comes with the header `ONCE`."""

_ONCE_PARAMETER = {
    "name": ONCE,
    "in": "header",
    "required": False,
    "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_KEY, "pattern": f"^[!-~]{{1,{LONGEST_KEY}}}$"},
    "description": "of the client's choice, for example a UUID: for a day, the same request with the same key is done"
    " once, and answered as it was the first time",
}


def _add_common_answers(document: dict[str, Any]) -> None:
    """Say of every operation that a key may be asked for, whether it is done once, and what may come of any request."""
    document["components"]["securitySchemes"] = {
        "key": {
            "type": "http",
            "scheme": "bearer",
            "description": "an API key (`tauscope key add`); not asked for by a service on loopback that has no keys",
        }
    }
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            scope = find_needed_scope(method.upper(), path)
            if scope is None:
                continue
            operation["security"] = [{"key": []}, {}]
            operation["x-tauscope-scope"] = scope.value
            met: list[str] = list(_COMMON)
            if is_audited(method.upper(), path) and not is_stop(method.upper(), path):
                met.append("storage-full")  # of the audit log, if of nothing else
            if method == "post" and is_repeatable(path):
                operation.setdefault("parameters", []).append(_ONCE_PARAMETER)
                met += _REPEATED
            for status, answer in problem_responses(*met).items():
                _merge_answer(operation["responses"], str(status), answer)
            operation["responses"] = dict(sorted(operation["responses"].items()))


def _merge_answer(responses: dict[str, Any], status: str, answer: dict[str, Any]) -> None:
    """Add what a status may mean to what it means already."""
    present = responses.setdefault(status, answer)
    if present is not answer:
        examples = present["content"][MEDIA_TYPE]["examples"]
        new = {code: value for code, value in answer["content"][MEDIA_TYPE]["examples"].items() if code not in examples}
        examples.update(new)
        present["description"] = "; ".join([present["description"], *(value["summary"] for value in new.values())])
