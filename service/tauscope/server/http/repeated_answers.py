"""Answers that are kept for repeated requests, on the disk or, where they hold a secret, in memory."""

import base64
import hashlib
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from pydantic import Field, ValidationError
from typing_extensions import override

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


class Answers(Protocol):
    """Answers by the name of their request."""

    def begin(self, name: str) -> bool:
        """Claim a request before anything is done.

        Raises OSError if that has to be written down and cannot be.

        Returns bool: False where the request was begun before.
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


_TIDY_EVERY = 500


class StoredAnswers(Answers):
    """Answers that outlast the service, each request durably claimed."""

    def __init__(self, folder: Path, clock: Callable[[], float] = time.time) -> None:
        """Open the store; its folder is made where it is missing, and answers that are too old go."""
        self._folder, self._clock = folder, clock
        self._lock = threading.Lock()
        self._begun = 0
        folder.mkdir(parents=True, exist_ok=True)
        self._tidy()

    @override
    def begin(self, name: str) -> bool:
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

    @override
    def finish(self, name: str, answer: KeptAnswer | None) -> None:
        if answer is None:
            (self._folder / name).unlink(missing_ok=True)
        else:
            write_atomically(self._folder / name, answer.model_dump_json().encode())

    @override
    def find(self, name: str) -> KeptAnswer | None:
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


MOST = 1000
"""Requests that are remembered; beyond it the oldest is forgotten."""


class MemoryAnswers(Answers):
    """Answers none of which is ever written to a disk."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin without any. `clock`: by which they age [s]."""
        self._clock = clock
        self._lock = threading.Lock()
        self._kept: dict[str, tuple[float, KeptAnswer | None]] = {}

    @override
    def begin(self, name: str) -> bool:
        now = self._clock()
        with self._lock:
            while self._kept and now - self._kept[self._oldest()][0] > LIFE_S:
                del self._kept[self._oldest()]
            if name in self._kept:
                return False
            if len(self._kept) == MOST:
                del self._kept[self._oldest()]
            self._kept[name] = (now, None)
            return True

    @override
    def finish(self, name: str, answer: KeptAnswer | None) -> None:
        with self._lock:
            if answer is None:
                self._kept.pop(name, None)
            elif name in self._kept:
                self._kept[name] = (self._kept[name][0], answer)

    @override
    def find(self, name: str) -> KeptAnswer | None:
        with self._lock:
            return self._kept.get(name, (0.0, None))[1]

    def _oldest(self) -> str:
        """The request that was begun first."""
        return next(iter(self._kept))
