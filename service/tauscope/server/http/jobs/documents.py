"""Routes that fetch the documents of a job that succeeded."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from fastapi import APIRouter, Response

from tauscope.server.http.jobs.answers import require_document
from tauscope.server.http.jobs.routes import ENDINGS, Identifier
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.problems import problem_responses
from tauscope.server.queue.workspace import Workspace

HTML = "text/html"
HTML_CONTENT: dict[str, Any] = {HTML: {"schema": {"type": "string"}}}

PAGE_HEADERS = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; sandbox"}
"""A report brings its style with it, runs no script, and may do nothing in the name of whoever reads it."""

Folder = TypeVar("Folder", bound=Workspace)


@dataclass(frozen=True)
class JobDocument(Generic[Folder]):
    """A document that a job leaves in its folder.

    read : callable
        its content, from the job's folder; None where it is damaged
    """

    name: str
    read: Callable[[Folder], bytes | None]
    summary: str
    description: str
    answer: dict[str, Any]
    media_type: str = "application/json"


def add_document_routes(
    router: APIRouter,
    finished: Callable[[Services, str], Folder],
    documents: Sequence[JobDocument[Folder]],
    *problems: str,
) -> None:
    """Give a collection of jobs the routes ``/{identifier}/…``, one a document."""
    for document in documents:
        _add_document_route(router, finished, document, problems)


def _add_document_route(
    router: APIRouter,
    finished: Callable[[Services, str], Folder],
    document: JobDocument[Folder],
    problems: Sequence[str],
) -> None:
    """One of the routes."""

    @router.get(
        f"/{{identifier}}/{document.name}",
        name=f"get_{document.name.replace('-', '_')}",
        summary=document.summary,
        description=document.description,
        response_class=Response,
        responses={
            200: document.answer,
            **problem_responses("not-found", *ENDINGS, *problems, "worker-lost", "internal"),
        },
    )
    def get_document(identifier: Identifier, services: ServicesDep) -> Response:
        content = document.read(finished(services, identifier))
        headers = PAGE_HEADERS if document.media_type == HTML else None
        return Response(require_document(content, identifier), headers=headers, media_type=document.media_type)
