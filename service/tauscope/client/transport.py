"""Requests over the standard library's HTTP: JSON, forms whose files are streamed from the disk, problems as errors."""

import json
import ssl
import uuid
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from tauscope.errors import TauscopeError
from tauscope.server.problems import MEDIA_TYPE

_PIECE = 2**18


class ApiError(TauscopeError):
    """A request that the service refused, or that did not reach it."""

    def __init__(self, code: str, status: int, detail: str) -> None:
        super().__init__(detail)
        self.problem_code, self.status, self.detail = code, status, detail


@dataclass(frozen=True)
class Answer:
    """What came back."""

    status: int
    headers: dict[str, str]
    body: bytes


class Transport:
    """One service; every request has a connection of its own, so that threads never wait for each other."""

    def __init__(self, url: str, key: str | None, timeout_s: float, ca_file: Path | None = None) -> None:
        """Nothing is sent yet. Raises ValueError: no address, or a key in clear. `timeout_s`: of each step [s]."""
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.path.strip("/") or parts.query:
            raise ValueError(f"{url}: no address of a service; give scheme, host and port only")
        if key is not None and parts.scheme == "http" and parts.hostname not in ("127.0.0.1", "localhost", "::1"):
            raise ValueError(f"{url}: the key would go over the network in clear; use https")
        self._parts, self._timeout_s = parts, timeout_s
        self._headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        self._context = ssl.create_default_context(cafile=ca_file) if parts.scheme == "https" else None

    def send(
        self, method: str, path: str, *, headers: Mapping[str, str] | None = None, content: "Content | None" = None
    ) -> Answer:
        """Make a request, and wait for its answer. Raises ApiError: the service's problem, or that it is silent."""
        body = content or Content("", (), 0)
        sent = {**self._headers, "Content-Length": str(body.length), **(headers or {})}
        if body.media_type:
            sent["Content-Type"] = body.media_type
        connection = self._connection()
        try:
            connection.request(method, path, body=body.pieces() if body.length else None, headers=sent)
            got = connection.getresponse()
            answer = Answer(got.status, {name.lower(): value for name, value in got.getheaders()}, got.read())
        except (OSError, HTTPException) as error:
            where = self._parts.netloc
            hint = "is the service up, and the address right?"
            raise ApiError("unreachable", 0, f"{where}: no answer ({error or type(error).__name__}); {hint}") from error
        finally:
            connection.close()
        if answer.status >= 400:
            raise _problem_of(answer)
        return answer

    def _connection(self) -> HTTPConnection:
        """A connection that is not open yet."""
        host, port = self._parts.hostname or "", self._parts.port
        if self._context is None:
            return HTTPConnection(host, port, timeout=self._timeout_s)
        return HTTPSConnection(host, port, timeout=self._timeout_s, context=self._context)


@dataclass(frozen=True)
class Content:
    """A body that can be sent more than once."""

    media_type: str
    parts: tuple[bytes | Path, ...]
    length: int

    def pieces(self) -> Iterator[bytes]:
        """The body, piece by piece."""
        for part in self.parts:
            if isinstance(part, bytes):
                yield part
                continue
            with part.open("rb") as file:
                while piece := file.read(_PIECE):
                    yield piece


def json_content(document: Any) -> Content:
    """A JSON body."""
    text = json.dumps(document, allow_nan=False).encode()
    return Content("application/json", (text,), len(text))


def form_content(document: Any, files: Sequence[tuple[str, Path]]) -> Content:
    """A form of a JSON part ``request``, None without one, and of files: the part's name, and the file."""
    boundary = uuid.uuid4().hex
    parts: list[bytes | Path] = []
    if document is not None:
        parts += [_part_head(boundary, "request", None), json_content(document).parts[0], b"\r\n"]
    for name, path in files:
        parts += [_part_head(boundary, name, path.name), path, b"\r\n"]
    parts.append(f"--{boundary}--\r\n".encode())
    length = sum(len(part) if isinstance(part, bytes) else part.stat().st_size for part in parts)
    return Content(f"multipart/form-data; boundary={boundary}", tuple(parts), length)


def _part_head(boundary: str, name: str, file_name: str | None) -> bytes:
    """What stands before the content of a part."""
    file = "" if file_name is None else f'; filename="{quote(file_name, safe=" +=@")}"'
    return f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"{file}\r\n\r\n'.encode()


def _problem_of(answer: Answer) -> ApiError:
    """The error that a refusal is."""
    if answer.headers.get("content-type", "").startswith(MEDIA_TYPE):
        try:
            problem = json.loads(answer.body)
            return ApiError(str(problem["code"]), answer.status, str(problem["detail"]))
        except (ValueError, KeyError, TypeError):
            pass
    return ApiError("unknown", answer.status, f"the answer {answer.status} is none of Tauscope's; check the address")
