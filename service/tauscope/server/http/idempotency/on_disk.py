"""Answers on the disk: one small file a request, written before anything is done."""

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import ValidationError
from typing_extensions import override

from tauscope.files import sync_folder, write_atomically
from tauscope.server.http.idempotency.answers import LIFE_S, Answers, KeptAnswer

_TIDY_EVERY = 500


class AnswersOnDisk(Answers):
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
