"""The keys as the running service knows them: in memory, so that no request waits for a disk, least of all a stop."""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime

from tauscope.errors import TauscopeError
from tauscope.server.auth.keys import ApiKey, KeyFile, matching_key, utc_now
from tauscope.server.auth.scopes import Scope

_log = logging.getLogger("tauscope.api")

LOOK_S = 1.0
"""How often the file is looked at: a key that was revoked or added counts after this time at the latest [s]."""


@dataclass(frozen=True)
class Caller:
    """Who makes a request."""

    name: str
    key: str | None
    scope: Scope


LOCAL = Caller("local", None, Scope.ADMIN)
"""Anybody on this machine, as long as the service has no keys."""


class KeyRing:
    """Tells callers by their keys.

    Once a service has had a key, it asks for one, also after the last was revoked. A file that is damaged while the
    service runs changes nothing: whoever could stop an arm can still do so.
    """

    def __init__(self, file: KeyFile, *, is_required: bool, clock: Callable[[], datetime] = utc_now) -> None:
        """Read the keys.

        Raises
        ------
        TauscopeError
            if the file is damaged
        """
        self._file, self._clock = file, clock
        self._is_required = is_required
        self._stamp = file.stamp()
        self._keys: tuple[ApiKey, ...] = file.read()

    @property
    def is_required(self) -> bool:
        """Whether a key is asked for."""
        return self._is_required or bool(self._keys)

    def has_valid_key(self) -> bool:
        """Whether anybody could get in."""
        return any(key.state(self._clock()) == "valid" for key in self._keys)

    def caller(self, text: str | None, *, may_be_expired: bool = False) -> Caller | str:
        """Who calls, or why that is nobody."""
        if not self.is_required:
            return LOCAL
        if text is None:
            return "no API key came with the request; send the header Authorization: Bearer KEY"
        key = matching_key(self._keys, text)
        state = None if key is None else key.state(self._clock())
        if key is None or state == "revoked":
            return "the API key is not known, or was revoked; ask the operator for one (tauscope key add)"
        if state == "expired" and not may_be_expired:
            return f"the API key of {key.name} has expired; ask the operator for a new one (tauscope key add)"
        return Caller(key.name, key.id, key.scope)

    def look(self) -> None:
        """Read the file again if it was changed."""
        try:
            stamp = self._file.stamp()
            if stamp != self._stamp:
                keys = self._file.read()
                self._keys, self._stamp = keys or self._revoked(), stamp
        except (TauscopeError, OSError):
            _log.exception("the API keys could not be read again; those known so far count")

    def _revoked(self) -> tuple[ApiKey, ...]:
        """All known keys as revoked: their file was taken away."""
        return tuple(key.model_copy(update={"revoked": key.revoked or self._clock()}) for key in self._keys)

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Look at the file again and again, within the context."""
        is_over = threading.Event()

        def watch() -> None:
            while not is_over.wait(LOOK_S):
                self.look()

        thread = threading.Thread(target=watch, name="keys", daemon=True)
        thread.start()
        try:
            yield
        finally:
            is_over.set()
            thread.join()
