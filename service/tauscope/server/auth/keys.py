"""API keys and their scopes: the key file holds salted hashes only; what no rule names needs the highest scope."""

import hashlib
import hmac
import logging
import re
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from pathlib import Path
from typing import Literal

from pydantic import AwareDatetime, Field, ValidationError

from tauscope.errors import TauscopeError
from tauscope.files import write_atomically
from tauscope.robot.messages import shown
from tauscope.server.store.data_folder import utc_now
from tauscope.server.store.files import lock_file
from tauscope.strict_model import StrictModel


class Scope(StrEnum):
    """What a key may do; each scope includes those before it."""

    READ = "read"  # look at everything, and stop every arm
    ANALYSE = "analyse"  # send recordings and robots, hand in and cancel analyses
    MOVE = "move"  # take, arm and move arms
    ADMIN = "admin"  # remove what was measured, take an arm from somebody else

    def includes(self, other: "Scope") -> bool:
        order = list(Scope)
        return order.index(self) >= order.index(other)


_ITEM = r"[^/]+"
_ANALYSES = "(identifications|diagnoses|excitations|rollouts)"

# Of requests that are no plain reading: the first rule that fits decides.
_RULES: tuple[tuple[str, re.Pattern[str], Scope], ...] = tuple(
    (method, re.compile(f"/api/v1/{path}"), scope)
    for method, path, scope in (
        # Whoever may see an arm move may stop it.
        ("POST", "stop", Scope.READ),
        ("POST", f"(runs|campaigns)/{_ITEM}/stop", Scope.READ),
        ("POST", "(robots|mappings)/check", Scope.ANALYSE),
        ("POST", "(recordings|robots)", Scope.ANALYSE),
        ("POST", _ANALYSES, Scope.ANALYSE),
        ("DELETE", f"{_ANALYSES}/{_ITEM}", Scope.ANALYSE),
        ("POST", f"events/{_ITEM}/acknowledge", Scope.ANALYSE),
        ("POST", f"schedules/{_ITEM}/run", Scope.MOVE),
        ("POST", "(runs|campaigns|leases)", Scope.MOVE),
        ("POST", f"leases/{_ITEM}/(heartbeat|arm|disarm)", Scope.MOVE),
        ("DELETE", f"leases/{_ITEM}", Scope.MOVE),
        ("DELETE", f"(recordings|robots/versions|runs|campaigns|schedules)/{_ITEM}", Scope.ADMIN),
        # What is compared with, and what moves at night, is the operator's to decide.
        ("POST", f"models/{_ITEM}/(activate|make-reference)", Scope.ADMIN),
        ("PUT", f"model-policy|schedules/{_ITEM}", Scope.ADMIN),
    )
)


def find_needed_scope(method: str, path: str) -> Scope | None:
    """The scope that a request needs; None for what anybody may read: pages, the interface's description, health."""
    is_reading = method in ("GET", "HEAD", "OPTIONS")
    if not path.startswith("/api/") and path != "/metrics":
        return None if is_reading else Scope.ADMIN
    if is_reading:
        return Scope.READ
    return next((scope for verb, rule, scope in _RULES if verb == method and rule.fullmatch(path)), Scope.ADMIN)


def is_stop(method: str, path: str) -> bool:
    """Whether a request stops an arm: nothing that can fail or wait may stand in its way."""
    return method == "POST" and re.fullmatch(rf"/api/v1/(stop|(runs|campaigns)/{_ITEM}/stop)", path) is not None


KEY_FILE = "keys.json"  # name of the file, in the data folder
_PREFIX = "tsk"
_NOBODY = "0" * 64


class ApiKey(StrictModel):
    """The secret is 256 random bits: one salted SHA-256 is enough, and a slow hash would keep the service busy."""

    id: str = Field(pattern="^[0-9a-f]{8}$", description="public part of the key")
    name: str = Field(min_length=1, max_length=100, description="who has it")
    scope: Scope = Field(strict=False, description="what it may do")
    salt: str = Field(pattern="^[0-9a-f]{32}$", description="hashed before the secret, in hexadecimal")
    hash: str = Field(pattern="^[0-9a-f]{64}$", description="SHA-256 of salt and secret, in hexadecimal")
    created: AwareDatetime = Field(description="when it was made")
    expires: AwareDatetime | None = Field(description="when it ends; null: never")
    revoked: AwareDatetime | None = Field(default=None, description="when it was taken back")

    def state(self, now: datetime) -> Literal["valid", "expired", "revoked"]:
        if self.revoked is not None:
            return "revoked"
        return "expired" if self.expires is not None and now >= self.expires else "valid"


class _KeyList(StrictModel):
    form: Literal["tauscope.keys/1"] = "tauscope.keys/1"
    keys: tuple[ApiKey, ...] = ()


class KeyFile:
    """The keys of a service, in one file that only its owner can read. Another store needs these four methods."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / KEY_FILE

    def read(self) -> tuple[ApiKey, ...]:
        """All keys ever made; none without a file. Raises TauscopeError if the file is damaged or cannot be read."""
        try:
            return _KeyList.model_validate_json(self.path.read_bytes()).keys
        except FileNotFoundError:
            return ()
        except (OSError, ValidationError):
            hint = "restore it from a backup, or move it away and make new keys"
            raise TauscopeError(f"{self.path}: the file of the API keys is damaged or not readable; {hint}") from None

    def stamp(self) -> tuple[int, int, int] | None:
        """Changes whenever the file does; None where there is none."""
        try:
            status = self.path.stat()
        except FileNotFoundError:
            return None
        return status.st_mtime_ns, status.st_size, status.st_ino

    def add(self, name: str, scope: Scope, now: datetime, life: timedelta | None) -> tuple[ApiKey, str]:
        """Make a key. Raises TauscopeError if the name is in use, or none."""
        if not (name.isprintable() and 0 < len(name.strip()) <= 100):
            raise TauscopeError(f"name {shown(name)}: give 1 to 100 printable characters")
        secret, salt = secrets.token_urlsafe(32), secrets.token_hex(16)
        expires = None if life is None else now + life
        key = ApiKey(
            id=secrets.token_hex(4),
            name=name,
            scope=scope,
            salt=salt,
            hash=_hash(salt, secret),
            created=now,
            expires=expires,
        )
        with self._changing() as keys:
            if any(other.name == name and other.revoked is None for other in keys):
                raise TauscopeError(f"name {shown(name)}: another key has it; choose another, or revoke that")
            keys.append(key)
        return key, f"{_PREFIX}_{key.id}_{secret}"

    def revoke(self, name: str, now: datetime) -> ApiKey:
        """Take a key back; a service that runs knows within seconds. Raises TauscopeError if there is no such key."""
        with self._changing() as keys:
            for place, key in enumerate(keys):
                if name in (key.name, key.id) and key.revoked is None:
                    keys[place] = key.model_copy(update={"revoked": now})
                    return keys[place]
        raise TauscopeError(f"key {shown(name)}: there is none, or it was revoked; see tauscope key list")

    @contextmanager
    def _changing(self) -> Iterator[list[ApiKey]]:
        """The keys, written back at the end; two programs never undo each other's change."""
        with lock_file(self.path.with_name(f".{KEY_FILE}.lock")):
            keys = list(self.read())
            yield keys
            write_atomically(self.path, _KeyList(keys=tuple(keys)).model_dump_json(indent=1).encode())


def match_key(keys: tuple[ApiKey, ...], text: str) -> ApiKey | None:
    """The key that a text is; takes the same time whatever is wrong with the text."""
    prefix, _, rest = text.partition("_")
    identifier, _, secret = rest.partition("_")
    found = next((key for key in keys if key.id == identifier), None)
    salt, expected = (_NOBODY[:32], _NOBODY) if found is None else (found.salt, found.hash)
    is_right = hmac.compare_digest(_hash(salt, secret), expected)
    return found if is_right and prefix == _PREFIX else None


def _hash(salt: str, secret: str) -> str:
    return hashlib.sha256(bytes.fromhex(salt) + secret.encode("utf-8", "surrogatepass")).hexdigest()


_log = logging.getLogger("tauscope.api")
CHECK_S = 1.0
"""How often the file is looked at: a key that was revoked or added counts after this time at the latest [s]."""


@dataclass(frozen=True)
class Caller:
    name: str
    key: str | None
    scope: Scope


LOCAL = Caller("local", None, Scope.ADMIN)  # anybody on this machine, as long as the service has no keys


class KeyRing:
    """Asks for a key once there was one, also after the last was revoked; keeps its keys while the file is damaged."""

    def __init__(self, file: KeyFile, *, is_required: bool, clock: Callable[[], datetime] = utc_now) -> None:
        """Read the keys. Raises TauscopeError if the file is damaged."""
        self._file, self._clock = file, clock
        self._is_required = is_required
        self._stamp = file.stamp()
        self._keys: tuple[ApiKey, ...] = file.read()

    @property
    def is_required(self) -> bool:
        return self._is_required or bool(self._keys)

    def has_valid_key(self) -> bool:
        return any(key.state(self._clock()) == "valid" for key in self._keys)

    def caller(self, text: str | None, *, may_be_expired: bool = False) -> Caller | str:
        if not self.is_required:
            return LOCAL
        if text is None:
            return "no API key came with the request; send the header Authorization: Bearer KEY"
        key = match_key(self._keys, text)
        state = None if key is None else key.state(self._clock())
        if key is None or state == "revoked":
            return "the API key is not known, or was revoked; ask the operator for one (tauscope key add)"
        if state == "expired" and not may_be_expired:
            return f"the API key of {key.name} has expired; ask the operator for a new one (tauscope key add)"
        return Caller(key.name, key.id, key.scope)

    def look(self) -> None:
        try:
            stamp = self._file.stamp()
            if stamp != self._stamp:
                # Where the file was taken away, all known keys count as revoked.
                now = self._clock()
                gone = tuple(key.model_copy(update={"revoked": key.revoked or now}) for key in self._keys)
                self._keys, self._stamp = self._file.read() or gone, stamp
        except (TauscopeError, OSError):
            _log.exception("the API keys could not be read again; those known so far count")
