"""Which problem each exception becomes, and requests that no route foresees: methods and query parameters."""

import logging
from collections.abc import Mapping
from http import HTTPStatus

from fastapi import FastAPI, Request, Response, params
from fastapi.dependencies.utils import get_flat_params
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.routing import Match

from tauscope.errors import TauscopeError, one_line
from tauscope.files import is_disk_full
from tauscope.robot.messages import nearest, shown
from tauscope.server.auth.keys import is_stop
from tauscope.server.control.leases import BusyError, LeasedError, LeaseLostError, LeaseNeededError, NotArmedError
from tauscope.server.problems import FieldError, ProblemError, field_errors, make_problem, problem_answer, summarise
from tauscope.server.queue.queue import QueueFullError
from tauscope.server.store.recordings import NameTakenError


async def require_known_query(request: Request) -> None:
    """Raises ProblemError for a query parameter that the route does not know; a stop is never refused."""
    if not request.query_params or is_stop(request.method, request.url.path):
        return
    fields = get_flat_params(request.scope["route"].dependant)
    known = {field.alias for field in fields if isinstance(field.field_info, params.Query)}
    unknown = sorted(set(request.query_params) - known)
    if unknown:
        hint = nearest(unknown[0], known) if known else "this address takes none"
        text = one_line(f"query parameter {shown(unknown[0])} is not known here; {hint}")
        errors = [FieldError(field=one_line(f"query.{name}")[:200], message="not known here") for name in unknown[:100]]
        raise ProblemError("invalid-request", text, errors=errors)


_log = logging.getLogger("tauscope.api")

_OF_ERROR: Mapping[type[Exception], str] = {
    QueueFullError: "queue-full",
    BusyError: "busy",
    NameTakenError: "name-taken",
    LeasedError: "leased",
    LeaseNeededError: "lease-needed",
    LeaseLostError: "lease-lost",
    NotArmedError: "not-armed",
}
_METHODS = ("DELETE", "GET", "HEAD", "PATCH", "POST", "PUT")
_OF_STATUS: Mapping[int, str] = {404: "not-found", 405: "method-not-allowed", 413: "limit-exceeded", 415: "media-type"}


def install_problem_handlers(app: FastAPI) -> None:
    app.exception_handler(TauscopeError)(_tauscope_error)
    app.exception_handler(RequestValidationError)(_validation_error)
    app.exception_handler(HTTPException)(_http_exception)
    app.exception_handler(OSError)(_system_error)
    app.exception_handler(ClientDisconnect)(_client_gone)


async def _tauscope_error(request: Request, error: TauscopeError) -> Response:
    code = _OF_ERROR.get(type(error), error.code)
    headers = {"Retry-After": "10"} if code in ("queue-full", "busy") else None
    return problem_answer(make_problem(code, str(error), request.url.path), headers)


async def _validation_error(request: Request, error: RequestValidationError) -> Response:
    fields = field_errors(error.errors())
    return problem_answer(make_problem("invalid-request", summarise(fields), request.url.path, fields))


async def _http_exception(request: Request, error: HTTPException) -> Response:
    """A problem that only a service meets: one of ours, or one of the framework's."""
    path = request.url.path
    if isinstance(error, ProblemError):
        return problem_answer(make_problem(error.code, error.detail, path, error.errors), error.headers)
    detail = {
        404: f"there is nothing at {path}; see /docs",
        405: f"{request.method} is not known at {path}; see /docs",
    }.get(error.status_code, error.detail)
    headers = dict(error.headers or {})
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        headers["Allow"] = ", ".join(each for each in _METHODS if _is_known(request, each))
    return problem_answer(make_problem(_OF_STATUS.get(error.status_code, "bad-request"), detail, path), headers)


def _is_known(request: Request, method: str) -> bool:
    """Whether a route answers this method at the address of a request."""
    scope = {**request.scope, "method": method}
    return any(route.matches(scope)[0] is Match.FULL for route in request.app.routes)


async def _system_error(request: Request, error: OSError) -> Response:
    """A full disk is said; any other failure of the system is a fault to look into."""
    if is_disk_full(error):
        _log.error("the disk is full")
        text = "the service's disk is full; remove recordings or identifications"
        return problem_answer(make_problem("storage-full", text, request.url.path))
    raise error


async def _client_gone(_request: Request, _error: Exception) -> Response:
    return Response(status_code=400)
