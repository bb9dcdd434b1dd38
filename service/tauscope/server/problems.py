"""Problems as RFC 9457 wants them: every failed request is answered with `application/problem+json`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

from fastapi import Response
from pydantic import Field, ValidationError
from starlette.exceptions import HTTPException

from tauscope.errors import one_line
from tauscope.strict_model import StrictModel

MEDIA_TYPE = "application/problem+json"
TYPE_PREFIX = "/docs/errors/"


@dataclass(frozen=True)
class ProblemKind:
    code: str
    status: HTTPStatus
    title: str


_KINDS = (
    # Codes of tauscope.errors; their pages stand in docs/errors/.
    ProblemKind("robot-file", HTTPStatus.UNPROCESSABLE_ENTITY, "The robot file cannot be read or is not valid"),
    ProblemKind("recording", HTTPStatus.UNPROCESSABLE_ENTITY, "A recording cannot be read or is not valid"),
    ProblemKind("recording-mismatch", HTTPStatus.UNPROCESSABLE_ENTITY, "A recording does not fit the robot"),
    ProblemKind("identification", HTTPStatus.UNPROCESSABLE_ENTITY, "The data cannot answer the question"),
    ProblemKind("export", HTTPStatus.CONFLICT, "The model cannot be written in this format"),
    ProblemKind("excitation", HTTPStatus.UNPROCESSABLE_ENTITY, "No motion keeps the limits, or it is not valid"),
    ProblemKind("scenario", HTTPStatus.UNPROCESSABLE_ENTITY, "The simulated arm's scenario is not valid"),
    ProblemKind("acquisition", HTTPStatus.CONFLICT, "The run cannot start, or ended before its time"),
    ProblemKind("store", HTTPStatus.SERVICE_UNAVAILABLE, "The database or the data folder cannot be used"),
    ProblemKind("not-found", HTTPStatus.NOT_FOUND, "Nothing of that name is kept here"),
    ProblemKind("limit-exceeded", HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "The request is larger than accepted"),
    ProblemKind("missing-extra", HTTPStatus.NOT_IMPLEMENTED, "An optional dependency is not installed"),
    # What only a service can meet.
    ProblemKind("invalid-request", HTTPStatus.UNPROCESSABLE_ENTITY, "The request is not as documented"),
    ProblemKind("bad-request", HTTPStatus.BAD_REQUEST, "The request cannot be understood"),
    ProblemKind("method-not-allowed", HTTPStatus.METHOD_NOT_ALLOWED, "This address does not know the method"),
    ProblemKind("media-type", HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "The request's body is of another media type"),
    ProblemKind("host", HTTPStatus.BAD_REQUEST, "The request is meant for another host"),
    ProblemKind("origin", HTTPStatus.FORBIDDEN, "Pages of other origins have no access"),
    ProblemKind("unauthorized", HTTPStatus.UNAUTHORIZED, "A valid API key is needed"),
    ProblemKind("forbidden", HTTPStatus.FORBIDDEN, "The API key may not do this"),
    ProblemKind("rate-limited", HTTPStatus.TOO_MANY_REQUESTS, "Too many requests"),
    ProblemKind("name-taken", HTTPStatus.CONFLICT, "Another recording of that name is kept"),
    ProblemKind("busy", HTTPStatus.CONFLICT, "Another run has the arm"),
    ProblemKind("leased", HTTPStatus.CONFLICT, "Somebody else has the lease of the arm"),
    ProblemKind("lease-needed", HTTPStatus.PRECONDITION_REQUIRED, "The arm moves for whoever has its lease"),
    ProblemKind("lease-lost", HTTPStatus.CONFLICT, "The lease does not hold any more"),
    ProblemKind("not-armed", HTTPStatus.CONFLICT, "The lease is not armed"),
    ProblemKind("not-repeatable", HTTPStatus.CONFLICT, "What became of the first request is not known (yet)"),
    ProblemKind("key-reused", HTTPStatus.UNPROCESSABLE_ENTITY, "The Idempotency-Key belongs to another request"),
    ProblemKind("not-finished", HTTPStatus.CONFLICT, "The job has not ended yet"),
    ProblemKind("cancelled", HTTPStatus.CONFLICT, "The job was cancelled"),
    ProblemKind("interrupted", HTTPStatus.CONFLICT, "The service ended before the job did"),
    ProblemKind("in-use", HTTPStatus.CONFLICT, "An active model or a reference rests on it"),
    ProblemKind("damaged", HTTPStatus.CONFLICT, "Files of this item are missing or damaged"),
    ProblemKind("not-ready", HTTPStatus.SERVICE_UNAVAILABLE, "The service cannot work now"),
    ProblemKind("queue-full", HTTPStatus.TOO_MANY_REQUESTS, "Too much is waiting already"),
    ProblemKind("storage-full", HTTPStatus.INSUFFICIENT_STORAGE, "The disk is full"),
    ProblemKind("worker-lost", HTTPStatus.INTERNAL_SERVER_ERROR, "The worker process ended unexpectedly"),
    ProblemKind("internal", HTTPStatus.INTERNAL_SERVER_ERROR, "A fault of Tauscope's own"),
)
KINDS: Mapping[str, ProblemKind] = {kind.code: kind for kind in _KINDS}


class FieldError(StrictModel):
    """One field of a request that is not as documented."""

    field: str = Field(description="path to the field, for example body.options.cutoff_hz", examples=["body.robot"])
    message: str = Field(description="what is wrong with it", examples=["Field required"])


class Problem(StrictModel):
    """A problem (RFC 9457)."""

    type: str = Field(description="page that explains the code", examples=["/docs/errors/recording"])
    title: str = Field(description="the kind of problem", examples=[KINDS["recording"].title])
    status: int = Field(description="HTTP status", examples=[422])
    detail: str = Field(
        description="one line: what is wrong, where, and what to do",
        examples=["log.csv: row 57: time 0.54 does not increase; remove the row"],
    )
    instance: str = Field(description="path of the request", examples=["/api/v1/identifications"])
    code: str = Field(description="stable code of the problem", examples=["recording"])
    errors: list[FieldError] | None = Field(default=None, description="with invalid-request: every field in question")


class ProblemError(HTTPException):
    """Ends a request with a problem that only a service can meet."""

    def __init__(
        self,
        code: str,
        detail: str,
        *,
        errors: Sequence[FieldError] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(KINDS[code].status, detail, headers)
        self.code = code
        self.errors = None if errors is None else list(errors)


def make_problem(code: str, detail: str, instance: str, errors: Sequence[FieldError] | None = None) -> Problem:
    kind = KINDS.get(code, KINDS["internal"])
    return Problem(
        type=f"{TYPE_PREFIX}{kind.code}",
        title=kind.title,
        status=int(kind.status),
        detail=one_line(detail),
        instance=instance,
        code=kind.code,
        errors=None if errors is None else list(errors),
    )


def problem_answer(problem: Problem, headers: Mapping[str, str] | None = None) -> Response:
    content = problem.model_dump_json(exclude_none=True)
    return Response(content, problem.status, dict(headers or {}), media_type=MEDIA_TYPE)


def field_errors(details: Sequence[Any], *, within: str = "") -> list[FieldError]:
    fields = []
    for detail in details[:100]:
        steps = [within, *detail["loc"]] if within else detail["loc"]
        place = one_line(".".join(str(step) for step in steps))
        fields.append(FieldError(field=place, message=one_line(detail["msg"])))
    return fields


def invalid_request(error: ValidationError, *, within: str) -> ProblemError:
    fields = field_errors(error.errors(include_url=False, include_context=False, include_input=False), within=within)
    return ProblemError("invalid-request", summarise(fields), errors=fields)


def summarise(fields: Sequence[FieldError]) -> str:
    more = f" (the first of {len(fields)} errors)" if len(fields) > 1 else ""
    return f"{fields[0].field}: {fields[0].message}{more}"


def problem_responses(*codes: str) -> dict[int | str, dict[str, Any]]:
    responses: dict[int | str, dict[str, Any]] = {}
    for code in codes:
        kind = KINDS[code]
        example = make_problem(code, "…", "/api/v1/…").model_dump(exclude_none=True)
        answer = responses.setdefault(
            int(kind.status),
            {
                "description": "",
                "content": {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}, "examples": {}}},
            },
        )
        answer["description"] = "; ".join(part for part in (answer["description"], kind.title) if part)
        answer["content"][MEDIA_TYPE]["examples"][code] = {"summary": kind.title, "value": example}
    return responses
