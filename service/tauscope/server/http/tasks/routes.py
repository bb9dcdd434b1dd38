"""Arguments and paths that routes about jobs share."""

from typing import Annotated

from fastapi import Path, Query, Request

Identifier = Annotated[str, Path(description="identifier", examples=["20261103T101502Z-1f2e3d4c"])]
Limit = Annotated[int, Query(ge=1, le=1000, description="most entries of the list")]
After = Annotated[str | None, Query(max_length=255, description="`next` of the page before; null: the first page")]

ENDINGS = ("not-finished", "cancelled", "interrupted", "damaged", "storage-full")
"""Problems of a job without result, beside those of its work."""


SUBMISSION = (
    "bad-request",
    "limit-exceeded",
    "media-type",
    "robot-file",
    "invalid-request",
    "storage-full",
)
"""Problems of handing anything in that comes with a robot file."""


MOTION = ("busy", "leased", "lease-needed", "lease-lost", "not-armed")
"""Problems of moving an arm that somebody else has, or that the lease does not let move."""


def collection(request: Request, steps_below: int) -> str:
    """Path of the collection, seen from a request below it."""
    return request.url.path.rsplit("/", steps_below)[0]
