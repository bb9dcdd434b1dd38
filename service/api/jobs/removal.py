"""The route that cancels an analysis, or removes it."""

from collections.abc import Callable

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from service.api.jobs.routes import Identifier, collection
from service.api.problems import problem_responses
from service.api.services import Offered, Services
from service.jobs import JobKind


def add_removal_route(
    router: APIRouter,
    noun: str,
    kind: Callable[[Services], JobKind],
    answer: type[BaseModel],
    describe: Callable[[Services, str, str], BaseModel],
) -> None:
    """Give a collection of jobs the route ``DELETE /{identifier}``.

    Parameters
    ----------
    router : APIRouter
        of the collection
    noun : str
        what one of them is called, with its article
    kind : callable
        finds the jobs of that kind among the services
    answer : type
        of what `describe` returns, for the documentation
    describe : callable
        describes a job that was cancelled: of the services, its identifier and the path of the collection
    """

    @router.delete(
        "/{identifier}",
        summary=f"Cancel or remove {noun}",
        response_model=answer,
        responses={204: {"description": "it had ended, and was removed"}, **problem_responses("not-found")},
    )
    def cancel_or_remove(request: Request, identifier: Identifier, services: Offered) -> BaseModel | Response:
        """One that waits or runs is cancelled; one that has ended is removed with all its files."""
        if services.jobs.cancel_or_remove(kind(services), identifier):
            return Response(status_code=204)
        return describe(services, identifier, collection(request, 1))
