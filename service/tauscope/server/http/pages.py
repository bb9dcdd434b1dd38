"""Pages for people: the interface, the codes of problems, how-to pages. They need nothing from elsewhere."""

from http import HTTPStatus
from pathlib import Path as FilePath
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from tauscope.errors import NotFoundError
from tauscope.robot.messages import one_line, shown
from tauscope.server.http.handbook import chapters
from tauscope.server.problems import KINDS

router = APIRouter(prefix="/docs", include_in_schema=False)

_METHODS = ("get", "post", "put", "delete")
_FOLDER = FilePath(__file__).parent / "templates"
_templates = Environment(
    loader=FileSystemLoader(_FOLDER),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


@router.get("")
def show_interface(request: Request) -> Response:
    """Every operation, from the OpenAPI document."""
    document = request.app.openapi()
    page = _templates.get_template("interface.html")
    guides = [(path, chapter.title) for path, chapter in chapters().items() if path.startswith("how-to/")]
    operations, kinds = _operations(document), KINDS.values()
    return HTMLResponse(page.render(info=document["info"], operations=operations, kinds=kinds, guides=guides))


@router.get("/pages.css")
def get_style() -> Response:
    """How the pages look; a file, because nothing inline is let through."""
    return Response((_FOLDER / "pages.css").read_bytes(), media_type="text/css")


@router.get("/errors/{code}")
def show_problem_kind(code: str) -> Response:
    """What a code means."""
    kind = KINDS.get(code)
    if kind is None:
        raise NotFoundError(one_line(f"there is no error code {shown(code)}; /docs lists them"))
    chapter = chapters().get(f"errors/{code}")
    return HTMLResponse(_templates.get_template("problem.html").render(kind=kind, chapter=chapter))


@router.get("/how-to/{name}")
def show_guide(name: str) -> Response:
    """How something is done."""
    chapter = chapters().get(f"how-to/{name}")
    if chapter is None:
        raise NotFoundError(one_line(f"there is no page {shown(name)}; /docs lists them"))
    return HTMLResponse(_templates.get_template("guide.html").render(chapter=chapter))


def _operations(document: dict[str, Any]) -> list[dict[str, Any]]:
    """Operations of an OpenAPI document, as the page shows them."""
    return [
        {
            "method": method.upper(),
            "path": path,
            "summary": operation.get("summary", ""),
            "description": operation.get("description", ""),
            "parameters": operation.get("parameters", []),
            "bodies": _bodies(document, operation.get("requestBody", {}).get("content", {})),
            "statuses": [
                (status, HTTPStatus(int(status)).phrase, answer["description"])
                for status, answer in sorted(operation["responses"].items())
            ],
        }
        for path, operations in document["paths"].items()
        for method, operation in operations.items()
        if method in _METHODS
    ]


def _bodies(document: dict[str, Any], content: dict[str, Any]) -> list[dict[str, Any]]:
    """Media types of a body, each with its fields and examples."""
    bodies = []
    for media_type, body in content.items():
        schema = body["schema"]
        if "$ref" in schema:
            schema = document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]]
        fields = [(name, field.get("description", "")) for name, field in schema.get("properties", {}).items()]
        examples = [(example["summary"], example["value"]) for example in body.get("examples", {}).values()]
        bodies.append({"media_type": media_type, "fields": fields, "examples": examples})
    return bodies
