"""Query parameters that a route does not know are refused: a misspelt filter would find everything."""

from collections.abc import Iterator

from fastapi import Request
from fastapi.dependencies.models import Dependant

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
