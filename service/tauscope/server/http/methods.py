"""Requests that no route foresees: methods and query parameters."""

import re
from collections.abc import Iterable, Iterator, Sequence

from fastapi import APIRouter, Request
from fastapi.dependencies.models import Dependant
from starlette.routing import Route, compile_path

from tauscope.robot.messages import nearest, one_line, shown
from tauscope.server.auth.scopes import is_stop
from tauscope.server.problems import FieldError, ProblemError


async def require_known_query(request: Request) -> None:
    """Refuse a request with a query parameter that its route does not know; a stop is never refused.

    Raises ProblemError naming the parameter.
    """
    if not request.query_params or is_stop(request.method, request.url.path):
        return
    known = set(_find_names(request.scope["route"].dependant))
    unknown = sorted(set(request.query_params) - known)
    if unknown:
        hint = nearest(unknown[0], known) if known else "this address takes none"
        text = one_line(f"query parameter {shown(unknown[0])} is not known here; {hint}")
        errors = [FieldError(field=one_line(f"query.{name}")[:200], message="not known here") for name in unknown[:100]]
        raise ProblemError("invalid-request", text, errors=errors)


def _find_names(dependant: Dependant) -> Iterator[str]:
    """Names of all query parameters of a route, and of what it depends on."""
    yield from (field.alias for field in dependant.query_params)
    for other in dependant.dependencies:
        yield from _find_names(other)


Methods = Sequence[tuple[re.Pattern[str], frozenset[str]]]
"""For each route the pattern of its path, and its methods."""


def collect_methods(routers: Iterable[tuple[str, APIRouter]]) -> Methods:
    """The methods of all routes. `routers`: iterable of (str, APIRouter), each with the prefix of its paths."""
    return tuple(
        (compile_path(prefix + route.path)[0], frozenset(route.methods or ()))
        for prefix, router in routers
        for route in router.routes
        if isinstance(route, Route)
    )


def find_methods(methods: Methods, path: str) -> list[str]:
    """The methods that an address knows, sorted."""
    return sorted({method for pattern, known in methods if pattern.match(path) for method in known})
