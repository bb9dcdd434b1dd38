"""What makes two bodies the same request."""

import hashlib

from python_multipart.multipart import parse_options_header


class Fingerprint:
    """A hash of a body as it arrives. Clients draw a new boundary for every form: it is left out."""

    def __init__(self, content_type: str) -> None:
        """Begin with an empty body."""
        media_type, options = parse_options_header(content_type)
        self._boundary = options.get(b"boundary") or b""
        self._hash = hashlib.sha256(media_type + b"\n")
        self._held = b""

    def add(self, piece: bytes) -> None:
        """Take the next bytes."""
        if not self._boundary:
            self._hash.update(piece)
            return
        text = (self._held + piece).replace(self._boundary, b"")
        # The last bytes may be the beginning of a boundary.
        keep = min(len(text), len(self._boundary) - 1)
        self._hash.update(text[: len(text) - keep])
        self._held = text[len(text) - keep :]

    def digest(self) -> str:
        """The hash of everything so far, in hexadecimal."""
        whole = self._hash.copy()
        whole.update(self._held)
        return whole.hexdigest()
