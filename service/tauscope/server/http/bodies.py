"""Bodies of requests: JSON of one media type, bounded and strict; forms whose files go to the disk as they arrive."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from fastapi import Request
from fastapi.responses import FileResponse
from pydantic import BaseModel, ValidationError
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header
from starlette.concurrency import run_in_threadpool

from tauscope.errors import LimitExceededError, TauscopeError
from tauscope.robot.messages import shown
from tauscope.server.auth.gate import require_upload_quota
from tauscope.server.problems import ProblemError, invalid_request
from tauscope.server.store.files import FILE_NAME_RULE, IncomingFile, KeptFile, is_file_name

if TYPE_CHECKING:
    from python_multipart.multipart import MultipartCallbacks


JSON = "application/json"
Model = TypeVar("Model", bound=BaseModel)


def media_type(request: Request) -> str:
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def refuse_media_type(request: Request, *accepted: str) -> ProblemError:
    found = media_type(request) or "of no stated media type"
    headers = {"Accept-Post": ", ".join(accepted)}
    return ProblemError("media-type", f"the body is {found}; send {' or '.join(accepted)}", headers=headers)


async def read_document(request: Request, kind: type[Model], limit: int) -> Model:
    """The JSON body of a request, up to `limit` [bytes]. Raises ProblemError or LimitExceededError."""
    if media_type(request) != JSON:
        raise refuse_media_type(request, JSON)
    content = bytearray()
    async for piece in request.stream():
        content += piece
        if len(content) > limit:
            raise LimitExceededError(f"the JSON is larger than the {limit} bytes accepted here; send files as a form")
    return parse_document(bytes(content), kind, within="body")


def parse_document(content: bytes, kind: type[Model], *, within: str) -> Model:
    """A model from JSON text. Raises ProblemError if it is not as the model wants it."""
    try:
        return kind.model_validate_json(content)
    except ValidationError as error:
        raise invalid_request(error, within=within) from None


def to_json_text(value: Any, place: str, kind: type[TauscopeError]) -> str:
    """Plain data as JSON. Raises an error of a kind where it holds NaN or infinity, or text that is not Unicode."""
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False)
        text.encode()
    except (ValueError, RecursionError):
        raise kind(f"{place}: holds NaN, infinity or text that is not Unicode; write plain numbers and text") from None
    return text


_MEDIA_TYPES: Mapping[str, str] = {".csv": "text/csv", ".json": "application/json"}


def file_answer(path: Path, name: str) -> FileResponse:
    """The answer that sends a file, to be saved under a name and never shown as a page."""
    media_type = _MEDIA_TYPES.get(Path(name).suffix.lower(), "application/octet-stream")
    return FileResponse(path, media_type=media_type, filename=name)


FORM = "multipart/form-data"


@dataclass(frozen=True)
class PartRule:
    """`limit`: largest size [bytes]; `folder`: of its files, None for text; `default_name`: of a file without one."""

    limit: int
    folder: Path | None = None
    most: int = 1
    default_name: str | None = None


@dataclass
class ReceivedForm:
    texts: dict[str, bytes] = field(default_factory=dict)
    files: dict[str, list[KeptFile]] = field(default_factory=dict)

    def file(self, name: str) -> KeptFile | None:
        files = self.files.get(name, [])
        return files[0] if files else None


async def receive_form(request: Request, rules: Mapping[str, PartRule]) -> ReceivedForm:
    """Read a form. Raises ProblemError if a part or a name is not allowed, LimitExceededError if one is too large."""
    if media_type(request) != FORM:
        raise refuse_media_type(request, FORM)
    charge = require_upload_quota(request.scope)
    receiver = _Receiver(rules)
    with _form_errors():
        _, options = parse_options_header(request.headers.get("content-type"))
        parser = MultipartParser(options.get(b"boundary") or b"", receiver.callbacks())
    try:
        async for piece in request.stream():
            if piece:
                charge(len(piece))
                await run_in_threadpool(_feed, parser, piece)
        with _form_errors():
            parser.finalize()
        if not receiver.has_ended:
            raise ProblemError("bad-request", "the form is cut off; send it again")
        return receiver.form
    except BaseException:
        receiver.discard()
        raise


def _feed(parser: MultipartParser, piece: bytes) -> None:
    """Parse and write the next bytes, outside the event loop because the disk may be slow."""
    with _form_errors():
        parser.write(piece)


@contextmanager
def _form_errors() -> Iterator[None]:
    try:
        yield
    except FormParserError as error:
        raise ProblemError("bad-request", f"the body is no multipart form: {error}") from None


class _Receiver:
    def __init__(self, rules: Mapping[str, PartRule]) -> None:
        self.form = ReceivedForm()
        self.has_ended = False
        self._rules = rules
        self._header = [b"", b""]
        self._headers: dict[bytes, bytes] = {}
        self._part = ""
        self._rule = PartRule(0)
        self._text: bytearray | None = None
        self._file: IncomingFile | None = None

    def callbacks(self) -> "MultipartCallbacks":
        return {
            "on_header_field": self._header_field,
            "on_header_value": self._header_value,
            "on_header_end": self._header_end,
            "on_headers_finished": self._headers_finished,
            "on_part_data": self._part_data,
            "on_part_end": self._part_end,
            "on_end": self._end,
        }

    def discard(self) -> None:
        if self._file is not None:
            self._file.discard()
        for file in (file for files in self.form.files.values() for file in files):
            file.path.unlink(missing_ok=True)

    def _header_field(self, data: bytes, start: int, end: int) -> None:
        self._header[0] += data[start:end]

    def _header_value(self, data: bytes, start: int, end: int) -> None:
        self._header[1] += data[start:end]

    def _header_end(self) -> None:
        self._headers[self._header[0].lower()] = self._header[1]
        self._header = [b"", b""]

    def _headers_finished(self) -> None:
        """A part begins: look its rule up, and open its file."""
        headers, self._headers = self._headers, {}
        _, options = parse_options_header(headers.get(b"content-disposition"))
        self._part = options.get(b"name", b"").decode("utf-8", "replace")
        rule = self._rules.get(self._part)
        if rule is None:
            known = ", ".join(self._rules)
            raise ProblemError("invalid-request", f"the form has a part {shown(self._part)}; known parts: {known}")
        self._rule = rule
        if rule.folder is None:
            if self._part in self.form.texts:
                raise ProblemError("invalid-request", f"part {self._part}: is there twice; send it once")
            self._text = bytearray()
            return
        filename = options.get(b"filename")
        name = rule.default_name if filename is None else filename.decode("utf-8", "replace")
        self._file = IncomingFile(rule.folder, self._accept_name(name), rule.limit)

    def _accept_name(self, name: str | None) -> str:
        files = self.form.files.setdefault(self._part, [])
        if name is None:
            raise ProblemError("invalid-request", f"part {self._part}: is not a file; send it with a file name")
        if not is_file_name(name):
            raise ProblemError("invalid-request", f"part {self._part}: file name {shown(name)}: {FILE_NAME_RULE}")
        if self._rule.folder is not None and (self._rule.folder / name).exists():
            raise ProblemError("invalid-request", f"part {self._part}: two files are named {name}; rename one")
        if len(files) >= self._rule.most:
            raise LimitExceededError(f"part {self._part}: more than {self._rule.most} files; send fewer")
        return name

    def _part_data(self, data: bytes, start: int, end: int) -> None:
        if self._file is not None:
            self._file.write(data[start:end])
        elif self._text is not None:
            self._text += data[start:end]
            if len(self._text) > self._rule.limit:
                limit = self._rule.limit
                raise LimitExceededError(f"part {self._part}: is larger than the {limit} bytes accepted here")

    def _part_end(self) -> None:
        """A part is complete: give its file its name."""
        if self._file is not None:
            kept = self._file.finish()
            path = kept.path.rename(kept.path.with_name(kept.name))
            self.form.files[self._part].append(KeptFile(path, kept.name, kept.size, kept.sha256))
            self._file = None
        elif self._text is not None:
            self.form.texts[self._part] = bytes(self._text)
            self._text = None

    def _end(self) -> None:
        self.has_ended = True
