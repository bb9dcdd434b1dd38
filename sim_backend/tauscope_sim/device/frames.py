"""Frames between the host and the device process: a header of fixed size, then a body of limited length.

The header is kind, sequence number and length of the body, little-endian. A reply carries the sequence number of its
request, so that a late one is never taken for the next. Nothing that arrives is ever executed or unpickled.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

PROTOCOL = 1
"""Version that host and device have to agree on."""

LARGEST_BODY = 65536
"""Longest body that is accepted [B]."""

_HEADER = struct.Struct("<BxxxII")


class FrameKind(IntEnum):
    """What a frame is."""

    HELLO = 1
    ENABLE = 2
    EXCHANGE = 3
    STOP = 4
    ACKNOWLEDGE = 5
    READ = 6
    INJECT = 7
    STATUS = 8
    GOODBYE = 9
    SHUT_DOWN = 10
    PUT_BACK = 11
    WELCOME = 64
    STATE = 65
    ERROR = 66
    REPORT = 67


@dataclass(frozen=True)
class Frame:
    """One message."""

    kind: FrameKind
    sequence: int
    body: bytes = b""

    def encode(self) -> bytes:
        """The frame as it goes over the wire."""
        return _HEADER.pack(self.kind, self.sequence, len(self.body)) + self.body


class BrokenFrameError(ValueError):
    """What arrived is no frame: the connection cannot be used any longer."""


class FrameBuffer:
    """Cuts a stream of bytes into frames."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> list[Frame]:
        """Take what arrived and return the frames that are complete.

        Raises BrokenFrameError where the kind is unknown or the body longer than `LARGEST_BODY`.
        """
        self._bytes += data
        frames: list[Frame] = []
        while len(self._bytes) >= _HEADER.size:
            kind, sequence, length = _HEADER.unpack_from(self._bytes)
            if length > LARGEST_BODY:
                raise BrokenFrameError(f"a frame of {length} bytes; the most is {LARGEST_BODY}")
            end = _HEADER.size + length
            if len(self._bytes) < end:
                break
            frames.append(Frame(_find_kind(kind), sequence, bytes(self._bytes[_HEADER.size : end])))
            del self._bytes[:end]
        return frames


def _find_kind(kind: int) -> FrameKind:
    """The kind of a number."""
    try:
        return FrameKind(kind)
    except ValueError as error:
        raise BrokenFrameError(f"a frame of the unknown kind {kind}") from error
