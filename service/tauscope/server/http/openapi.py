"""The OpenAPI document: bodies that the framework does not see; parts that repeat are written once, and referred to."""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import reduce
from http import HTTPStatus
from itertools import count
from operator import getitem
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from tauscope.server.auth.gate import is_audited
from tauscope.server.auth.keys import find_needed_scope, is_stop
from tauscope.server.http.repeated_requests import HEADER as ONCE
from tauscope.server.http.repeated_requests import LONGEST_KEY, is_repeatable
from tauscope.server.problems import MEDIA_TYPE, Problem, problem_responses

_COMMON = (
    *("bad-request", "host", "origin", "unauthorized", "forbidden", "invalid-request", "limit-exceeded", "media-type"),
    *("rate-limited", "queue-full", "internal", "worker-lost", "store", "storage-full"),
)
"""Problems that any request to the interface may meet, before its route or in it."""
_VALUES = ("examples", "default", "enum", "const")  # keywords of a schema that hold plain data
_LEAST_SHARED = 150  # A shorter schema is not worth a name and two references [characters]
SCHEMAS = "#/components/schemas/"


def share_parts(document: dict[str, Any]) -> None:
    """Refer to parts that repeat, and leave out keywords that say nothing more."""
    _refer_to_formats(document)
    schemas = document["components"]["schemas"]
    used = _find_schemas(schemas, document["paths"])
    document["components"]["schemas"] = {name: schema for name, schema in schemas.items() if name in used}
    _drop_descriptions_of_answers(document)
    for node in _schema_nodes(document):
        _shorten(node)
    _share_problems(document)
    for operation in _operations(document):
        _shorten_answers(operation)
    _share_parameters(document)
    _share_answers(document)
    _share_properties(document)


def format_address(name: str) -> str:
    return f"/docs/schemas/{name}"


def _refer_to_formats(document: dict[str, Any]) -> None:
    """Have answers that are files, which state their schema, name it instead of holding it."""
    schemas = document["components"]["schemas"].items()
    formats = [name for name, schema in schemas if "schema" in schema.get("properties", {})]
    addresses = {SCHEMAS + name: format_address(name) for name in formats}
    for operation in _operations(document):
        for answer in operation["responses"].values():
            for content in answer.get("content", {}).values():
                address = addresses.get(content.get("schema", {}).get("$ref"))
                if address is not None:
                    file = {"type": "object", "additionalProperties": True}
                    content["schema"] = {**file, "externalDocs": {"url": address}}


def _drop_descriptions_of_answers(document: dict[str, Any]) -> None:
    """Leave the words on answers to `format_address`: requests are written by hand, answers are read by their types."""
    schemas = document["components"]["schemas"]
    sent = [operation.get("requestBody", {}) for operation in _operations(document)]
    for name in schemas.keys() - _find_schemas(schemas, sent):
        for node in _nodes(schemas[name]):
            for keyword in ("description", "examples"):
                node.pop(keyword, None)


def _find_schemas(schemas: dict[str, Any], node: Any) -> set[str]:
    open_, found = [json.dumps(node)], set[str]()
    while open_:
        new = set(re.findall(r'"#/components/schemas/([^"]+)"', open_.pop())) - found
        found |= new
        open_ += [json.dumps(schemas[name]) for name in new]
    return found


def _operations(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for operations in document["paths"].values():
        yield from operations.values()


def _schema_nodes(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield from _nodes([*document["components"]["schemas"].values(), *_operations(document)])


def _nodes(node: Any) -> Iterator[dict[str, Any]]:
    """Objects of a part of the document that are no plain data and no lists of properties."""
    if isinstance(node, list):
        for each in node:
            yield from _nodes(each)
    elif isinstance(node, dict):
        yield node
        for keyword, value in node.items():
            if keyword == "properties":
                yield from _nodes(list(value.values()))
            elif keyword not in _VALUES:
                yield from _nodes(value)


def _shorten(node: dict[str, Any]) -> None:
    """Leave out titles, which repeat names, and defaults that are null or those of a model; null is one more type."""
    if isinstance(node.get("title"), str):
        del node["title"]
    if "default" in node and (node["default"] is None or isinstance(node["default"], dict)):
        del node["default"]
    match node.get("anyOf"):
        case [{"type": str(kind)} as only, {"type": "null"}] if not {"enum", "const"} & set(only):
            del node["anyOf"]
            node |= {**only, "type": [kind, "null"]}


def _shorten_answers(operation: dict[str, Any]) -> None:
    """A parameter is described once; an answer of which nothing is known is described by its status."""
    for parameter in operation.get("parameters", []):
        if "description" in parameter:
            parameter["schema"].pop("description", None)
    for status, answer in operation["responses"].items():
        if answer.get("description") == "Successful Response":
            answer["description"] = HTTPStatus(int(status)).phrase


def _share_problems(document: dict[str, Any]) -> None:
    """Hold each problem's example once; `default` holds those of any request, and a status without others goes."""
    examples: dict[str, Any] = {}
    shared: dict[str, dict[str, Any]] = {}
    for operation in _operations(document):
        answers = operation["responses"]
        common = problem_responses(*_COMMON) if "x-tauscope-scope" in operation else {}
        for status, answer in list(answers.items()):
            if MEDIA_TYPE not in answer.get("content", {}):
                continue
            if set(answer["content"][MEDIA_TYPE]["examples"]) <= set(_COMMON) and common:
                del answers[status]
                continue
            if int(status) in common:
                merge_problems(answers, status, common[int(status)])
            answers[status] = _refer(status, answer, examples, shared)
        if common:
            whole: dict[str, Any] = {}
            for answer in common.values():
                merge_problems(whole, "default", answer)
            answers["default"] = _refer("any", whole["default"], examples, shared)
    document["components"] |= {"examples": dict(sorted(examples.items())), "responses": dict(sorted(shared.items()))}


def _refer(
    name: str, answer: dict[str, Any], examples: dict[str, Any], shared: dict[str, dict[str, Any]]
) -> dict[str, str]:
    """Share an answer and its examples; the reference to it, by its only problem, or by its status and a number."""
    content = answer["content"][MEDIA_TYPE]
    codes = sorted(content["examples"])
    examples |= {code: {"value": content["examples"][code]["value"]} for code in codes}
    references = {code: {"$ref": f"#/components/examples/{code}"} for code in codes}
    whole = {**answer, "description": ", ".join(codes), "content": {MEDIA_TYPE: {**content, "examples": references}}}
    if len(codes) == 1:
        name = codes[0]
    elif name.isdecimal():
        alike = [each for each in shared if each.startswith(f"{name}-")]
        name = next((each for each in alike if shared[each] == whole), f"{name}-{len(alike) + 1}")
    shared[name] = whole
    return {"$ref": f"#/components/responses/{name}"}


def merge_problems(answers: dict[str, Any], status: str, answer: dict[str, Any]) -> None:
    present = answers.setdefault(status, answer)["content"][MEDIA_TYPE]
    present["examples"] = {**answer["content"][MEDIA_TYPE]["examples"], **present["examples"]}


Slot = tuple[Any, Any]  # a list or an object, and the place in it that holds a part


def _share(slots: Sequence[Slot], section: str, shared: Any, name: Callable[[Slot], str], least: int) -> None:
    """Put each part of at least so many characters that several slots hold into a section of the document once."""
    counts = Counter(json.dumps(holder[key], sort_keys=True) for holder, key in slots)
    names: dict[str, str] = {}
    for holder, key in slots:
        text = json.dumps(holder[key], sort_keys=True)
        if counts[text] == 1 or len(text) < least or "$ref" in holder[key]:
            continue
        if text not in names:
            names[text] = name((holder, key))
            shared[names[text]] = holder[key]
        holder[key] = {"$ref": f"#/components/{section}/{names[text]}"}


def _share_parameters(document: dict[str, Any]) -> None:
    lists = [operation["parameters"] for operation in _operations(document) if "parameters" in operation]
    shared: dict[str, Any] = {}

    def name(slot: Slot) -> str:
        own = slot[0][slot[1]]["name"]
        alike = sum(each["name"] == own for each in shared.values())
        return f"{own}-{alike + 1}" if alike else own

    _share([(each, place) for each in lists for place in range(len(each))], "parameters", shared, name, 0)
    document["components"]["parameters"] = dict(sorted(shared.items()))


def _share_answers(document: dict[str, Any]) -> None:
    answers, numbers = [operation["responses"] for operation in _operations(document)], count(1)

    def name(slot: Slot) -> str:
        found = re.search(r'schemas/(\w+)"', json.dumps(slot[0][slot[1]]))
        return f"{found[1] if found else 'answer'}-{next(numbers)}"

    slots = [(each, status) for each in answers for status in each]
    _share(slots, "responses", document["components"]["responses"], name, _LEAST_SHARED)


def _share_properties(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    nodes = [node["properties"] for node in _schema_nodes(document) if isinstance(node.get("properties"), dict)]

    def name(slot: Slot) -> str:
        name = "".join(part.capitalize() for part in slot[1].split("_"))
        while name in schemas:
            name += "Field"
        return name

    _share([(each, key) for each in nodes for key in each], "schemas", schemas, name, _LEAST_SHARED)
    document["components"]["schemas"] = dict(sorted(schemas.items()))


_REFERENCE = SCHEMAS + "{model}"
Examples = Mapping[str, tuple[str, Any]]  # for each example its summary and its value


def json_body(model: type[BaseModel], examples: Examples) -> dict[str, Any]:
    shown = {name: {"summary": summary, "value": value} for name, (summary, value) in examples.items()}
    return {"application/json": {"schema": refer_to_model(model), "examples": shown}}


def takes_document(model: type[BaseModel], examples: Examples, *problems: str) -> dict[str, Any]:
    """What a route with a JSON body says of it. `problems`: codes, beside those of any body."""
    return {
        "responses": problem_responses("bad-request", "limit-exceeded", "media-type", *problems),
        "openapi_extra": {"requestBody": {"required": True, "content": json_body(model, examples)}},
    }


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
    return {**_FILE, "description": description}


def binary_parts(description: str) -> dict[str, Any]:
    return {"type": "array", "items": _FILE, "description": description}


ROBOT_PARTS = {
    "robot": binary_part("the robot file (YAML)"),
    "urdf": binary_part("the URDF that the robot file names, by its bare name"),
}


def file_contents(*media_types: str) -> dict[str, Any]:
    """A file of one of several types; generators of clients read by the first: bytes where there is one, else text."""
    ranks = {_BYTES: 0, "application/json": 2}
    ordered = sorted(media_types, key=lambda each: (ranks.get(each, 0 if each.startswith("text/") else 1), each))
    schemas = {_BYTES: {"type": "string", "format": "binary"}, "application/json": {}}
    return {media_type: {"schema": schemas.get(media_type, {"type": "string"})} for media_type in ordered}


def file_responses(media_types: Sequence[str], *problems: str, description: str = "the file") -> dict[int | str, Any]:
    return {200: {"content": file_contents(*media_types), "description": description}, **problem_responses(*problems)}


_referred: set[type[BaseModel]] = {Problem}  # models of bodies that the framework does not see


def refer_to_model(model: type[BaseModel]) -> dict[str, str]:
    _referred.add(model)
    return {"$ref": _REFERENCE.format(model=model.__name__)}


def resolve_reference(document: Mapping[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in node:
        _, *steps = node["$ref"].split("/")
        node = reduce(getitem, steps, document)
    return node


def install_openapi(app: FastAPI) -> None:
    """Fit the document to 150 kB; ``app.state.schemas`` holds every model in full, as text by name."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            whole = get_openapi(
                title=app.title,
                version=app.version,
                summary=app.summary,
                description=app.description,
                routes=app.routes,
            )
            kinds: list[tuple[type[BaseModel], JsonSchemaMode]] = [
                (model, "validation") for model in sorted(_referred, key=lambda each: each.__name__)
            ]
            _, definitions = models_json_schema(kinds, ref_template=_REFERENCE)
            schemas = whole.setdefault("components", {}).setdefault("schemas", {})
            schemas.update(definitions.get("$defs", {}))
            _add_common_answers(whole)
            app.state.schemas = {name: json.dumps(each).replace(SCHEMAS, "") for name, each in schemas.items()}
            share_parts(whole)
            app.openapi_schema = whole
        return app.openapi_schema

    app.openapi = document


_REPEATED = ("not-repeatable", "key-reused")  # further problems of a request that comes with the header `ONCE`

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
