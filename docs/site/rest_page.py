"""Pages of the REST interface, from the OpenAPI document that the repository holds."""

import json
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from docs.site.navigation import REPOSITORY

DOCUMENT = "tests/server/http/openapi.json"
Node = Mapping[str, Any]


@cache
def load_document() -> Node:
    """The OpenAPI document; a test holds it to the code."""
    return json.loads((REPOSITORY / DOCUMENT).read_text(encoding="utf-8"))


def rest_page() -> str:
    """Every operation, by its tag."""
    document = load_document()
    info = document["info"]
    by_tag: dict[str, list[str]] = {}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            by_tag.setdefault(operation["tags"][0], []).append(format_operation(method, path, operation))
    parts = [
        f"# REST interface\n\nVersion {info['version']}. {info['description']} "
        "The fields of each body are in [Schemas](schemas.md), the codes of problems in [Errors](../errors/index.md).\n"
    ]
    for tag, operations in by_tag.items():
        parts += [f"## {tag.capitalize()}\n", *operations]
    return "\n".join(parts)


def schemas_page() -> str:
    """Every schema with its fields."""
    parts = ["# Schemas of the REST interface\n\nBodies of the [requests and answers](rest.md) in JSON.\n"]
    for name, schema in load_document()["components"]["schemas"].items():
        parts.append(f"## {name}\n")
        if words := flatten(schema.get("description", "")):
            parts.append(f"{words}\n")
        if fields := schema.get("properties"):
            rows = ((f"`{field}`", format_type(node), describe(node)) for field, node in fields.items())
            parts.append(format_table(("field", "type", "meaning"), rows))
        else:
            parts.append(f"Type: {format_type(schema)}\n")
    return "\n".join(parts)


def format_operation(method: str, path: str, operation: Node) -> str:
    """One operation: its words, parameters, body and answers."""
    scope = operation.get("x-tauscope-scope")
    parts = [
        f"### `{method.upper()} {path}`\n",
        f"**{operation['summary']}.** {flatten(operation.get('description', ''))}"
        + (f" Scope: `{scope}`." if scope else "")
        + "\n",
    ]
    if parameters := [resolve(each) for each in operation.get("parameters", [])]:
        rows = ((f"`{each['name']}`", each["in"], describe(each)) for each in parameters)
        parts.append(format_table(("parameter", "in", "meaning"), rows))
    for media_type, body in operation.get("requestBody", {}).get("content", {}).items():
        parts.append(f"Body `{media_type}`: {format_type(body.get('schema', {}))}\n")
    rows = ((status, format_answer(resolve(answer))) for status, answer in sorted(operation["responses"].items()))
    parts.append(format_table(("status", "answer"), rows))
    return "\n".join(parts)


def format_answer(answer: Node) -> str:
    """What an answer holds: the schemas of its bodies, else its description."""
    bodies = (body.get("schema", {}) for body in answer.get("content", {}).values())
    types = {format_type(body) for body in bodies if "$ref" in body}
    return ", ".join([*sorted(types), flatten(answer.get("description", ""))])


def format_type(node: Node) -> str:
    """The type of a schema in Markdown, with links to the schemas that it refers to."""
    if "$ref" in node:
        section, name = node["$ref"].split("/")[-2:]
        return f"[{name}](schemas.md#{name.lower()})" if section == "schemas" else format_type(resolve(node))
    if "const" in node or "enum" in node:
        return ", ".join(f"`{value}`" for value in node.get("enum", [node.get("const")]))
    if choices := node.get("anyOf") or node.get("oneOf"):
        return " or ".join(dict.fromkeys(format_type(each) for each in choices))
    kinds = node.get("type", "any")
    words = " or ".join(kinds) if isinstance(kinds, list) else kinds
    if "items" in node:
        return words.replace("array", f"array of {format_type(node['items'])}")
    if isinstance(node.get("additionalProperties"), Mapping):
        return words.replace("object", f"object of {format_type(node['additionalProperties'])}")
    if words == "object" and (fields := node.get("properties")):
        return f"object: {', '.join(f'`{field}`' for field in fields)}"
    return words


def describe(node: Node) -> str:
    """The description of a field, or that of what it refers to."""
    return flatten(node.get("description") or resolve(node).get("description", ""))


def resolve(node: Node) -> Node:
    """What a node refers to; the node itself where it refers to nothing."""
    found = node
    while "$ref" in found:
        target: Any = load_document()
        for key in found["$ref"].removeprefix("#/").split("/"):
            target = target[key]
        found = target
    return found


def flatten(text: str) -> str:
    """A description in one line, which a cell of a table can hold."""
    return " ".join(text.split()).replace("|", "\\|").replace("<", "\\<")


def format_table(heads: tuple[str, ...], rows: Iterator[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = [heads, ("---",) * len(heads), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
