"""Answers that are kept on the disk for repeated requests."""

import base64
import hashlib
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import Field, ValidationError

from tauscope.files import sync_folder, write_atomically
from tauscope.strict_model import StrictModel

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


def request_name(caller: str, path: str, key: str) -> str:
    """What a request is called: nobody meets another caller's answers."""
    return hashlib.sha256("\n".join((caller, path, key)).encode()).hexdigest()


_TIDY_EVERY = 500


class StoredAnswers:
    """Answers that outlast the service, each request durably claimed."""

    def __init__(self, folder: Path, clock: Callable[[], float] = time.time) -> None:
        """Open the store; its folder is made where it is missing, and answers that are too old go."""
        self._folder, self._clock = folder, clock
        self._lock = threading.Lock()
        self._begun = 0
        folder.mkdir(parents=True, exist_ok=True)
        self._tidy()

    def begin(self, name: str) -> bool:
        """Claim a request before anything is done.

        Raises OSError if that has to be written down and cannot be.

        Raises OSError if that cannot be written down. Returns bool: False where the request was begun before.
        """
        with self._lock:
            self._begun += 1
            if self._begun % _TIDY_EVERY == 0:
                self._tidy()
        try:
            descriptor = os.open(self._folder / name, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        except FileExistsError:
            return False
        os.close(descriptor)
        sync_folder(self._folder)
        return True

    def finish(self, name: str, answer: KeptAnswer | None) -> None:
        """Keep the answer, or forget a request that did nothing."""
        if answer is None:
            (self._folder / name).unlink(missing_ok=True)
        else:
            write_atomically(self._folder / name, answer.model_dump_json().encode())

    def find(self, name: str) -> KeptAnswer | None:
        """The answer to a request; None where there is none (yet)."""
        try:
            return KeptAnswer.model_validate_json((self._folder / name).read_bytes())
        except (OSError, ValidationError):
            return None

    def _tidy(self) -> None:
        """Remove what is too old."""
        for entry in self._folder.iterdir():
            try:
                if self._clock() - entry.stat().st_mtime > LIFE_S:
                    entry.unlink(missing_ok=True)
            except OSError:
                continue
