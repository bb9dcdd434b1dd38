"""Repeated requests: a POST with an Idempotency-Key is done once, however often it comes, also across a crash."""

import base64
import hashlib
import os
import re
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import cast

from pydantic import Field
from python_multipart.multipart import parse_options_header
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Send
from starlette.types import Scope as AsgiScope
from typing_extensions import override

from tauscope.files import sync_folder, write_atomically
from tauscope.server.auth.gate import HttpMiddleware, find_caller
from tauscope.server.problems import ProblemError, make_problem, problem_answer
from tauscope.server.store.files import read_stored
from tauscope.strict_model import StrictModel

LIFE_S = 24 * 3600.0  # how long an answer is kept [s]


class KeptAnswer(StrictModel):
    fingerprint: str = Field(description="of the request's body, in hexadecimal")
    status: int = Field(description="of the answer")
    headers: tuple[tuple[str, str], ...] = Field(description="of the answer")
    body: str = Field(description="of the answer, in base64")


_TIDY_EVERY = 500


class StoredAnswers:
    """Answers that outlast the service, each request durably claimed."""

    def __init__(self, folder: Path, clock: Callable[[], float] = time.time) -> None:
        self._folder, self._clock = folder, clock
        self._lock = threading.Lock()
        self._begun = 0
        folder.mkdir(parents=True, exist_ok=True)
        self._tidy()

    def begin(self, name: str) -> bool:
        """Claim a request before anything is done; False where it was begun before. Raises OSError."""
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
        return read_stored(self._folder / name, KeptAnswer)

    def _tidy(self) -> None:
        for entry in self._folder.iterdir():
            with suppress(OSError):
                if self._clock() - entry.stat().st_mtime > LIFE_S:
                    entry.unlink(missing_ok=True)


class Fingerprint:
    """A hash of a body as it arrives. Clients draw a new boundary for every form: it is left out."""

    def __init__(self, content_type: str) -> None:
        media_type, options = parse_options_header(content_type)
        self._boundary = options.get(b"boundary") or b""
        self._hash = hashlib.sha256(media_type + b"\n")
        self._held = b""

    def add(self, piece: bytes) -> None:
        if not self._boundary:
            self._hash.update(piece)
            return
        text = (self._held + piece).replace(self._boundary, b"")
        # The last bytes may be the beginning of a boundary.
        keep = min(len(text), len(self._boundary) - 1)
        self._hash.update(text[: len(text) - keep])
        self._held = text[len(text) - keep :]

    def digest(self) -> str:
        whole = self._hash.copy()
        whole.update(self._held)
        return whole.hexdigest()


HEADER = "Idempotency-Key"
LONGEST_KEY = 200  # most characters of the header's value
_REPEATABLE = re.compile(
    r"/api/v1/(runs|campaigns|identifications|diagnoses|excitations|rollouts|recordings|robots(?:/check)?|schedules/[^/]+/run)"
)
_KEY = re.compile(rf"[\x21-\x7e]{{1,{LONGEST_KEY}}}")


class IdempotentRequests(HttpMiddleware):
    def __init__(self, app: ASGIApp) -> None:
        super().__init__(app)
        self._underway: set[str] = set()

    @override
    async def answer(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        key = Headers(scope=scope).get(HEADER)
        if key is None or scope["method"] != "POST" or not is_repeatable(scope["path"]):
            return await self.app(scope, receive, send)
        if not _KEY.fullmatch(key):
            text = f"header {HEADER}: give 1 to {LONGEST_KEY} characters without blanks, for example a UUID"
            return await self.refuse(ProblemError("invalid-request", text), scope, receive, send)
        store = cast(StoredAnswers, scope["app"].state.services.answers)
        # Nobody meets another caller's answers.
        words = (find_caller(scope).key or "local", scope["path"], key)
        name = hashlib.sha256("\n".join(words).encode()).hexdigest()
        is_underway = name in self._underway
        try:
            is_new = not is_underway and await run_in_threadpool(store.begin, name)
        except OSError:
            text = "the request could not be written down, so that it was not begun; make room on the disk"
            return await self.refuse(ProblemError("storage-full", text), scope, receive, send)
        if not is_new:
            return await (await _repeat(scope, receive, store, name, is_underway))(scope, receive, send)
        self._underway.add(name)
        try:
            await self._answer_first(scope, receive, send, store, name)
        finally:
            self._underway.discard(name)

    async def _answer_first(
        self, scope: AsgiScope, receive: Receive, send: Send, store: StoredAnswers, name: str
    ) -> None:
        fingerprint = Fingerprint(Headers(scope=scope).get("content-type", ""))
        answer = _Captured()
        await self.app(scope, _count_body(receive, fingerprint), answer.take)
        kept = None
        # What was refused has done nothing, and may be corrected and sent again.
        if not 400 <= answer.status < 500:
            body = base64.b64encode(bytes(answer.body)).decode()
            headers = tuple((name.decode("latin-1"), value.decode("latin-1")) for name, value in answer.headers)
            kept = KeptAnswer(fingerprint=fingerprint.digest(), status=answer.status, headers=headers, body=body)
        await run_in_threadpool(store.finish, name, kept)
        for message in answer.messages:
            await send(message)


def is_repeatable(path: str) -> bool:
    """Whether a POST to a path creates or moves something, and is done once for an Idempotency-Key."""
    return _REPEATABLE.fullmatch(path) is not None


class _Captured:
    """An answer that is not sent yet; those of repeatable requests are short."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self.status = 500
        self.body = bytearray()
        self.headers: list[tuple[bytes, bytes]] = []

    async def take(self, message: Message) -> None:
        self.messages.append(message)
        if message["type"] == "http.response.start":
            self.status, self.headers = message["status"], list(message["headers"])
        elif message["type"] == "http.response.body":
            self.body += message.get("body", b"")


def _count_body(receive: Receive, fingerprint: Fingerprint) -> Receive:
    async def received() -> Message:
        message = await receive()
        fingerprint.add(message.get("body", b"") or b"")
        return message

    return received


async def _repeat(scope: AsgiScope, receive: Receive, store: StoredAnswers, name: str, is_underway: bool) -> Response:
    fingerprint = Fingerprint(Headers(scope=scope).get("content-type", ""))
    more = True
    while more:
        message = await receive()
        fingerprint.add(message.get("body", b"") or b"")
        more = message["type"] == "http.request" and message.get("more_body", False)
    kept = await run_in_threadpool(store.find, name)
    if kept is None:
        text = "the first request with this Idempotency-Key is still being answered; ask again"
        if not is_underway:
            text = "the service ended while it answered the first request with this Idempotency-Key; look into the list"
            text += " whether it was done, and use a new key if not"
        headers = {"Retry-After": "1"} if is_underway else {}
        return problem_answer(make_problem("not-repeatable", text, scope["path"]), headers)
    if kept.status < 500 and kept.fingerprint != fingerprint.digest():
        text = "this Idempotency-Key was sent with another body before; use a new key for a new request"
        return problem_answer(make_problem("key-reused", text, scope["path"]))
    answer = Response(base64.b64decode(kept.body), kept.status)
    answer.raw_headers = [(k.encode("latin-1"), v.encode("latin-1")) for k, v in kept.headers]
    answer.headers["Idempotency-Replayed"] = "true"
    return answer
