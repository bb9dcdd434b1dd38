"""What is remembered of recordings: the hash of their bytes, and that of the bytes which were kept at first."""

import json
import logging
import os
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tauscope.files import write_atomically

_log = logging.getLogger("tauscope.store")


@dataclass(frozen=True)
class KnownHash:
    """What is known of a recording's bytes.

    sha256 : str
        of the bytes, in hexadecimal
    kept : str or None
        of the bytes that were sent or recorded; None for a file that an operator put there, and may change
    """

    sha256: str
    kept: str | None

    @property
    def is_damaged(self) -> bool:
        """Whether the bytes are not those that were kept."""
        return self.kept not in (None, self.sha256)


class RecordingHashes:
    """A small file a recording, which names the size and the time of the file that its hash belongs to.

    What is missing or damaged here can be computed again; only what the recording was in the beginning is lost then.
    """

    def __init__(self, root: Path) -> None:
        """Open the memory; its folder is made where it is missing."""
        self._root = root
        root.mkdir(parents=True, exist_ok=True)

    def of(self, name: str, status: os.stat_result) -> KnownHash | None:
        """What is known of a recording, unless its file was written since."""
        content = self._read(name)
        if content is None or (content["size"], content["modified_ns"]) != (status.st_size, status.st_mtime_ns):
            return None
        return KnownHash(content["sha256"], content.get("kept"))

    def is_kept(self, name: str) -> bool:
        """Whether it is known what a recording was in the beginning."""
        content = self._read(name)
        return content is not None and content.get("kept") is not None

    def keep(self, name: str, status: os.stat_result, sha256: str) -> None:
        """Write down what is about to be kept.

        Raises
        ------
        OSError
            if the disk does not take it
        """
        self._write(name, status, KnownHash(sha256, kept=sha256))

    def remember(self, name: str, status: os.stat_result, sha256: str) -> KnownHash:
        """Remember the present hash of a recording; a disk that takes nothing costs the memory alone."""
        before = self._read(name)
        known = KnownHash(sha256, None if before is None else before.get("kept"))
        try:
            self._write(name, status, known)
        except OSError:
            _log.warning("the hash of recording %s could not be remembered", name, exc_info=True)
        return known

    def forget(self, name: str) -> None:
        """Forget a recording."""
        self._path(name).unlink(missing_ok=True)

    def tidy(self, is_there: Callable[[str], bool]) -> None:
        """Forget recordings that are gone, or never came; to be called before anything arrives."""
        for path in self._root.iterdir():
            if not is_there(path.name.removesuffix(".json")):
                path.unlink(missing_ok=True)

    def _write(self, name: str, status: os.stat_result, known: KnownHash) -> None:
        """Write what is known, unless that is written already."""
        content = {"size": status.st_size, "modified_ns": status.st_mtime_ns, **asdict(known)}
        content |= {"check": _check(content)}
        if content != self._read(name):
            write_atomically(self._path(name), json.dumps(content).encode())

    def _path(self, name: str) -> Path:
        """The file of a recording's hash."""
        return self._root / f"{name}.json"

    def _read(self, name: str) -> dict[str, Any] | None:
        """What is remembered; None where that is missing or damaged."""
        try:
            content = json.loads(self._path(name).read_bytes())
        except (OSError, ValueError, RecursionError):
            return None
        if not isinstance(content, dict) or not isinstance(content.get("sha256"), str):
            return None
        # Earlier versions remembered neither a check nor what was kept.
        is_whole = "check" not in content or content["check"] == _check(content)
        return content if is_whole and {"size", "modified_ns"} <= content.keys() else None


def _check(content: dict[str, Any]) -> int:
    """A number that other content does not have: a flipped bit here must not be taken for a damaged recording."""
    values = [content.get(key) for key in ("size", "modified_ns", "sha256", "kept")]
    return zlib.crc32(json.dumps(values).encode())
