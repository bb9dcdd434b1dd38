"""Parts of the OpenAPI document that repeat: each is written once, and referred to."""

import json
from collections import Counter
from collections.abc import Iterator
from typing import Any

from tauscope.server.problems import MEDIA_TYPE, problem_responses

_COMMON = (
    "bad-request",
    "host",
    "origin",
    "unauthorized",
    "forbidden",
    "invalid-request",
    "rate-limited",
    "internal",
)
"""Problems that any request to the interface may meet, before its route or in it."""

_VALUES = ("examples", "default", "enum", "const")
"""Keywords of a schema that hold plain data."""


def share_parts(document: dict[str, Any]) -> None:
    """Refer to problems and parameters, and leave out titles, which repeat the names of properties."""
    for operation in _operations(document):
        _drop_titles(operation)
    for schema in document["components"]["schemas"].values():
        _drop_titles(schema)
    _share_problems(document)
    _share_parameters(document)


def _operations(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Operations of all paths."""
    for operations in document["paths"].values():
        yield from operations.values()


def _drop_titles(node: Any) -> None:
    """Remove the titles of a schema and of all within it."""
    if isinstance(node, list):
        for each in node:
            _drop_titles(each)
    elif isinstance(node, dict):
        if isinstance(node.get("title"), str):
            del node["title"]
        for keyword, value in node.items():
            if keyword == "properties":
                for schema in value.values():
                    _drop_titles(schema)
            elif keyword not in _VALUES:
                _drop_titles(value)


def _share_problems(document: dict[str, Any]) -> None:
    """Put each problem's example, and each set of problems, into the document once.

    The answer `default` of an operation with a scope holds the problems of any request.
    """
    examples: dict[str, Any] = {}
    shared: dict[str, Any] = {}
    for operation in _operations(document):
        answers = operation["responses"]
        common = problem_responses(*_COMMON) if "x-tauscope-scope" in operation else {}
        for status, answer in common.items():
            if str(status) in answers:
                merge_problems(answers, str(status), answer)
        for status, answer in answers.items():
            if MEDIA_TYPE in answer.get("content", {}):
                answers[status] = _refer(answer, examples, shared)
        if common:
            whole: dict[str, Any] = {}
            for answer in common.values():
                merge_problems(whole, "default", answer)
            answers["default"] = _refer(whole["default"], examples, shared, name="any-request")
    document["components"] |= {"examples": dict(sorted(examples.items())), "responses": dict(sorted(shared.items()))}


def _refer(
    answer: dict[str, Any], examples: dict[str, Any], shared: dict[str, Any], name: str | None = None
) -> dict[str, str]:
    """Share an answer and its examples; the reference to it."""
    content = answer["content"][MEDIA_TYPE]
    problems = content["examples"]
    examples |= problems
    name = name or "-or-".join(sorted(problems))
    references = {code: {"$ref": f"#/components/examples/{code}"} for code in problems}
    shared[name] = {**answer, "content": {MEDIA_TYPE: {**content, "examples": references}}}
    return {"$ref": f"#/components/responses/{name}"}


def merge_problems(answers: dict[str, Any], status: str, answer: dict[str, Any]) -> None:
    """Add problems to those that a status has."""
    present = answers.setdefault(status, answer)
    if present is not answer:
        examples = present["content"][MEDIA_TYPE]["examples"]
        new = {code: value for code, value in answer["content"][MEDIA_TYPE]["examples"].items() if code not in examples}
        examples.update(new)
        present["description"] = "; ".join([present["description"], *(value["summary"] for value in new.values())])


def _share_parameters(document: dict[str, Any]) -> None:
    """Put each parameter that several operations have into the document once."""
    lists = [operation["parameters"] for operation in _operations(document) if "parameters" in operation]
    counts = Counter(json.dumps(each, sort_keys=True) for each in (each for found in lists for each in found))
    shared: dict[str, Any] = {}
    names: dict[str, str] = {}
    for parameters in lists:
        for place, parameter in enumerate(parameters):
            text = json.dumps(parameter, sort_keys=True)
            if counts[text] == 1:
                continue
            if text not in names:
                alike = sum(each["name"] == parameter["name"] for each in shared.values())
                names[text] = f"{parameter['name']}-{alike + 1}" if alike else parameter["name"]
                shared[names[text]] = parameter
            parameters[place] = {"$ref": f"#/components/parameters/{names[text]}"}
    document["components"]["parameters"] = dict(sorted(shared.items()))
