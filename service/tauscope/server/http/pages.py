"""Pages for people: the interface, the error codes and the how-to pages; they need no network."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from http import HTTPStatus
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt
from markdown_it.token import Token

from tauscope.errors import NotFoundError
from tauscope.robot.messages import nearest, shown
from tauscope.server.http.openapi import resolve_reference
from tauscope.server.problems import KINDS

SECTIONS = ("errors", "how-to")
_ROOTS = (Path(__file__).parent / "handbook_pages", Path(__file__).parents[4] / "docs")
"""Where the pages lie: beside this file where the package was installed, in docs/ of a source tree."""
_markdown = MarkdownIt("commonmark", {"html": False}).enable("table")


@dataclass(frozen=True)
class Chapter:
    title: str
    html: str


@cache
def load_chapters() -> Mapping[str, Chapter]:
    """Every page, by its path below /docs: ``errors/recording``."""
    root = next((each for each in _ROOTS if (each / SECTIONS[0]).is_dir()), None)
    if root is None:
        return {}
    files = (file for section in SECTIONS for file in sorted((root / section).glob("*.md")) if file.stem != "README")
    texts = {f"{file.parent.name}/{file.stem}": file.read_text(encoding="utf-8") for file in files}
    return MappingProxyType({path: render_chapter(text, path, texts) for path, text in texts.items()})


def render_chapter(text: str, path: str, known: Mapping[str, object]) -> Chapter:
    """A page from its Markdown. Markup of HTML stays text, and a link that leads to no page becomes its words."""
    tokens = _markdown.parse(text)
    for token in tokens:
        if token.children is not None:
            token.children = _relink_tokens(token.children, path, known)
    heading = next((token.content for token in tokens if token.type == "inline"), path)
    return Chapter(heading.replace("`", ""), _markdown.renderer.render(tokens, _markdown.options, {}))


def _relink_tokens(tokens: Sequence[Token], path: str, known: Mapping[str, object]) -> list[Token]:
    """Inline tokens whose links lead to pages of the service; of other links the words stay, of pictures nothing."""
    kept, is_open = [], True
    for token in tokens:
        if token.type == "link_open":
            target = _target(str(token.attrs["href"]), path, known)
            is_open = target is not None
            token.attrs["href"] = target or ""
        if token.type == "image" or (token.type.startswith("link_") and not is_open):
            continue
        kept.append(token)
    return kept


def _target(link: str, path: str, known: Mapping[str, object]) -> str | None:
    """Where a relative link leads on the service; None where it has no such page."""
    match = re.fullmatch(r"(?:\.\./)?([\w./-]+)\.md(#[\w-]+)?", link)
    if match is None:
        return None
    place = match[1] if link.startswith("../") else f"{path.partition('/')[0]}/{match[1]}"
    return f"/docs/{place}{match[2] or ''}" if place in known else None


router = APIRouter(prefix="/docs", include_in_schema=False)
_METHODS = ("get", "post", "put", "delete")
_FOLDER = Path(__file__).parent / "templates"
_templates = Environment(
    loader=FileSystemLoader(_FOLDER), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
)


@router.get("")
def show_interface(request: Request) -> Response:
    """Every operation, from the OpenAPI document."""
    document = request.app.openapi()
    page = _templates.get_template("interface.html")
    guides = [(path, chapter.title) for path, chapter in load_chapters().items() if path.startswith("how-to/")]
    operations, kinds = _operations(document), KINDS.values()
    return HTMLResponse(page.render(info=document["info"], operations=operations, kinds=kinds, guides=guides))


@router.get("/pages.css")
def get_style() -> Response:
    """How the pages look; a file, because nothing inline is let through."""
    return Response((_FOLDER / "pages.css").read_bytes(), media_type="text/css")


@router.get("/errors/{code}")
def show_problem_kind(code: str) -> Response:
    kind = KINDS.get(code)
    if kind is None:
        raise NotFoundError(f"there is no error code {shown(code)}; /docs lists them")
    chapter = load_chapters().get(f"errors/{code}")
    return HTMLResponse(_templates.get_template("problem.html").render(kind=kind, chapter=chapter))


@router.get("/how-to/{name}")
def show_guide(name: str) -> Response:
    chapter = load_chapters().get(f"how-to/{name}")
    if chapter is None:
        raise NotFoundError(f"there is no page {shown(name)}; /docs lists them")
    return HTMLResponse(_templates.get_template("guide.html").render(chapter=chapter))


@router.get("/schemas/{name}")
def get_schema(name: str, request: Request) -> Response:
    """The JSON Schema of a request, an answer or a file; a reference leads to its neighbour."""
    request.app.openapi()
    schemas: Mapping[str, str] = request.app.state.schemas
    if name not in schemas:
        raise NotFoundError(f"there is no schema {shown(name)}; {nearest(name, set(schemas))}")
    return Response(schemas[name], media_type="application/schema+json")


def _operations(document: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        {
            "method": method.upper(),
            "path": path,
            "summary": operation.get("summary", ""),
            "description": operation.get("description", ""),
            "parameters": [resolve_reference(document, each) for each in operation.get("parameters", [])],
            "bodies": _bodies(document, operation.get("requestBody", {}).get("content", {})),
            "statuses": [
                (
                    status,
                    HTTPStatus(int(status)).phrase if status.isdecimal() else "of any request",
                    resolve_reference(document, answer)["description"],
                )
                for status, answer in sorted(operation["responses"].items())
            ],
        }
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
        if method in _METHODS
    ]


def _bodies(document: dict[str, Any], content: dict[str, Any]) -> list[dict[str, Any]]:
    bodies = []
    for media_type, body in content.items():
        schema = resolve_reference(document, body["schema"])
        fields = [(name, field.get("description", "")) for name, field in schema.get("properties", {}).items()]
        examples = [(example["summary"], example["value"]) for example in body.get("examples", {}).values()]
        bodies.append({"media_type": media_type, "fields": fields, "examples": examples})
    return bodies
