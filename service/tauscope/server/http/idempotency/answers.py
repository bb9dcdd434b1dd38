"""Answers that are kept for those who ask again with the same key."""

import base64
import hashlib
from typing import Protocol

from pydantic import Field

from tauscope.server.models import StrictModel

LIFE_S = 24 * 3600.0
"""How long an answer is kept [s]."""


class KeptAnswer(StrictModel):
    """What was answered."""

    fingerprint: str = Field(description="of the request's body, in hexadecimal")
    status: int = Field(description="of the answer")
    headers: tuple[tuple[str, str], ...] = Field(description="of the answer")
    body: str = Field(description="of the answer, in base64")

    def content(self) -> bytes:
        """The body as it was sent."""
        return base64.b64decode(self.body)


class Answers(Protocol):
    """Answers by the name of their request."""

    def begin(self, name: str) -> bool:
        """Claim a request before anything is done.

        Returns
        -------
        bool
            False where the request was begun before

        Raises
        ------
        OSError
            if that has to be written down and cannot be
        """
        ...

    def finish(self, name: str, answer: KeptAnswer | None) -> None:
        """Keep the answer, or forget a request that did nothing."""
        ...

    def find(self, name: str) -> KeptAnswer | None:
        """The answer to a request; None where there is none (yet)."""
        ...


def request_name(caller: str, path: str, key: str) -> str:
    """What a request is called: nobody meets another caller's answers."""
    return hashlib.sha256("\n".join((caller, path, key)).encode()).hexdigest()
