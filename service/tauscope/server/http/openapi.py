"""The OpenAPI document: bodies that the framework does not see, and models that only they refer to."""

import json
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
from tauscope.server.http.openapi_sharing import SCHEMAS, merge_problems, share_parts
from tauscope.server.http.repeated_requests import HEADER as ONCE
from tauscope.server.http.repeated_requests import LONGEST_KEY, is_repeatable
from tauscope.server.problems import problem_responses

_REFERENCE = SCHEMAS + "{model}"

Examples = Mapping[str, tuple[str, Any]]
"""For each example its summary and its value."""


def json_body(model: type[BaseModel], examples: Examples) -> dict[str, Any]:
    """A JSON body of an operation. `examples`: mapping of str to (str, plain data), summary and value by name."""
    shown = {name: {"summary": summary, "value": value} for name, (summary, value) in examples.items()}
    return {"application/json": {"schema": model_reference(model), "examples": shown}}


def form_body(parts: Mapping[str, Any], required: Sequence[str]) -> dict[str, Any]:
    """A multipart body of an operation; an object in it is JSON."""
    schema = {"type": "object", "properties": dict(parts), "additionalProperties": False}
    if required:
        schema["required"] = list(required)
    return {"multipart/form-data": {"schema": schema}}


_BYTES = "application/octet-stream"
_FILE = {"type": "string", "format": "binary", "contentMediaType": _BYTES}
"""A file in a form: OpenAPI 3.1 says so by its media type, generators of clients look for the format of 3.0."""


def binary_part(description: str) -> dict[str, Any]:
    """The schema of a file in a form."""
    return {**_FILE, "description": description}


def binary_parts(description: str) -> dict[str, Any]:
    """The schema of several files in a form."""
    return {"type": "array", "items": _FILE, "description": description}


def file_contents(*media_types: str) -> dict[str, Any]:
    """The content of an answer that is a file of one of several types.

    Generators of clients read by the first type: bytes where there is one, else text.
    """
    ranks = {_BYTES: 0, "application/json": 2}
    ordered = sorted(media_types, key=lambda each: (ranks.get(each, 0 if each.startswith("text/") else 1), each))
    schemas = {_BYTES: {"type": "string", "format": "binary"}, "application/json": {}}
    return {media_type: {"schema": schemas.get(media_type, {"type": "string"})} for media_type in ordered}


def model_reference(model: type[BaseModel]) -> dict[str, str]:
    """A reference to a model of the document."""
    return {"$ref": _REFERENCE.format(model=model.__name__)}


def resolve_reference(document: Mapping[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    """A part of a document, or that to which it refers."""
    while "$ref" in node:
        _, *steps = node["$ref"].split("/")
        node = reduce(getitem, steps, document)
    return node


def install_openapi(app: FastAPI, models: Sequence[type[BaseModel]], formats: Sequence[type[BaseModel]]) -> None:
    """Have the application's OpenAPI document hold further models, and refer to formats of files by their address.

    ``app.state.schemas`` then holds every model in full, as text by name: a reference is the other model's name.
    """

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            whole = _document(app, models)
            schemas = whole["components"]["schemas"].items()
            app.state.schemas = {name: json.dumps(each).replace(SCHEMAS, "") for name, each in schemas}
            share_parts(whole, formats)
            app.openapi_schema = whole
        return app.openapi_schema

    app.openapi = document


def _document(app: FastAPI, models: Sequence[type[BaseModel]]) -> dict[str, Any]:
    """The document with all models, each part as often as it is used."""
    document = get_openapi(
        title=app.title, version=app.version, summary=app.summary, description=app.description, routes=app.routes
    )
    _, definitions = models_json_schema([(model, "validation") for model in models], ref_template=_REFERENCE)
    components = document.setdefault("components", {}).setdefault("schemas", {})
    components.update(definitions.get("$defs", {}))
    _add_common_answers(document)
    return document


_REPEATED = ("not-repeatable", "key-reused")
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
    """Say of every operation that a key may be asked for, whether it is done once, and the problems of both."""
    document["components"]["securitySchemes"] = {
        "key": {
            "type": "http",
            "scheme": "bearer",
            "description": "an API key (`tauscope key add`); not asked for by a service on loopback that has no keys",
        }
    }
    words = "Every field of an answer and of a file: /docs/schemas/NAME, NAME as in components/schemas."
    document["externalDocs"] = {"url": "/docs", "description": words}
    document["security"] = [{"key": []}, {}]
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            scope = find_needed_scope(method.upper(), path)
            if scope is None:
                operation["security"] = []
                continue
            operation["x-tauscope-scope"] = scope.value
            if "HTTPValidationError" in str(operation["responses"].get("422")):
                del operation["responses"]["422"]  # the framework's own form is never sent
            met: list[str] = []
            if is_audited(method.upper(), path) and not is_stop(method.upper(), path):
                met.append("storage-full")  # of the audit log, if of nothing else
            if method == "post" and is_repeatable(path):
                operation.setdefault("parameters", []).append(_ONCE_PARAMETER)
                met += _REPEATED
            for status, answer in problem_responses(*met).items():
                merge_problems(operation["responses"], str(status), answer)
            operation["responses"] = dict(sorted(operation["responses"].items()))
