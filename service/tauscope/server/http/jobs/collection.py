"""The routes that every collection of analyses has: they are listed, followed, and cancelled or removed."""

from collections.abc import Callable

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from tauscope.server.http.jobs.routes import Identifier, Limit, collection
from tauscope.server.http.services import Services, ServicesDep
from tauscope.server.problems import problem_responses
from tauscope.server.queue.queue import JobKind

Describe = Callable[[Services, str, str], BaseModel]


def add_collection_routes(
    router: APIRouter,
    noun: str,
    kind: Callable[[Services], JobKind],
    answers: tuple[type[BaseModel], type[BaseModel]],
    describe: Describe,
) -> None:
    """Give a collection of jobs the routes ``GET``, ``GET /{identifier}`` and ``DELETE /{identifier}``.

    Parameters
    ----------
    answers : (type, type)
        what `describe` returns, and the list of it, whose one field is named in the plural
    """
    plural, singular = router.prefix.removeprefix("/"), noun.rpartition(" ")[2]
    answer, list_answer = answers

    @router.get("", name=f"list_{plural}", summary=f"List {plural}", response_model=list_answer)
    def list_jobs(request: Request, services: ServicesDep, limit: Limit = 100) -> BaseModel:
        """The newest first."""
        identifiers = kind(services).items.identifiers()[:limit]
        return list_answer(**{plural: [describe(services, each, request.url.path) for each in identifiers]})

    @router.get(
        "/{identifier}",
        name=f"get_{singular}",
        summary=f"Follow {noun}",
        response_model=answer,
        responses=problem_responses("not-found"),
    )
    def get_job(request: Request, identifier: Identifier, services: ServicesDep) -> BaseModel:
        """Its state, and where to go on from there."""
        return describe(services, identifier, collection(request, 1))

    @router.delete(
        "/{identifier}",
        summary=f"Cancel or remove {noun}",
        response_model=answer,
        responses={204: {"description": "it had ended, and was removed"}, **problem_responses("not-found")},
    )
    def cancel_or_remove(request: Request, identifier: Identifier, services: ServicesDep) -> BaseModel | Response:
        """One that waits or runs is cancelled; one that has ended is removed with all its files."""
        if services.jobs.cancel_or_remove(kind(services), identifier):
            return Response(status_code=204)
        return describe(services, identifier, collection(request, 1))
