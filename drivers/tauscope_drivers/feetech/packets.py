"""Frames of Feetech's protocol as bytes: pure functions and one parser, no port.

A frame is FF FF, ID, length, instruction or alarms, parameters, checksum. An instruction looks like an answer: an
adapter that echoes is found by comparing with the request. Source: Feetech, "FT-SCS communication protocol".
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from typing_extensions import override

from tauscope_drivers.serial_servos.bus import FrameParser

HEADER = b"\xff\xff"
BROADCAST_ID = 0xFE
HIGHEST_ID = 253

ANSWER_BYTES = 6  # of an answer without data

LONGEST_FRAME = 259

_PING, _READ, _WRITE, _SYNC_READ, _SYNC_WRITE = 0x01, 0x02, 0x03, 0x82, 0x83
_FIXED_BYTES = 4


@dataclass(frozen=True)
class Status:
    """An answer."""

    servo: int
    alarms: int  # bits of the register Status
    data: bytes


def checksum(body: bytes | bytearray) -> int:
    """Complement of the sum of all bytes from the ID on."""
    return ~sum(body) & 0xFF


def encode_frame(servo: int, code: int, parameters: bytes = b"") -> bytes:
    """A frame."""
    body = bytes([servo, len(parameters) + 2, code]) + parameters
    return HEADER + body + bytes([checksum(body)])


def encode_ping(servo: int = BROADCAST_ID) -> bytes:
    """Ask who is there."""
    return encode_frame(servo, _PING)


def encode_read(servo: int, address: int, length: int) -> bytes:
    """Read a stretch of the memory table."""
    return encode_frame(servo, _READ, bytes([address, length]))


def encode_write(servo: int, address: int, data: bytes) -> bytes:
    """Write a stretch of the memory table."""
    return encode_frame(servo, _WRITE, bytes([address]) + data)


def encode_sync_read(servos: Sequence[int], address: int, length: int) -> bytes:
    """Read the same stretch of many servos, which answer in their order."""
    return encode_frame(BROADCAST_ID, _SYNC_READ, bytes([address, length, *servos]))


def encode_sync_write(values: Mapping[int, bytes], address: int) -> bytes:
    """Write the same stretch of many servos; none answers. Raises ValueError where their lengths differ."""
    length = len(next(iter(values.values())))
    if any(len(data) != length for data in values.values()):
        raise ValueError("a Sync Write carries the same number of bytes to every servo")
    parts = b"".join(bytes([servo]) + data for servo, data in values.items())
    return encode_frame(BROADCAST_ID, _SYNC_WRITE, bytes([address, length]) + parts)


class FeetechParser(FrameParser):
    """Finds whole frames in what comes from a port."""

    header, fixed_bytes, longest = HEADER, _FIXED_BYTES, LONGEST_FRAME

    @override
    def find_end(self, start: bytearray) -> int | None:
        end = _FIXED_BYTES + start[3]
        return end if start[2] <= BROADCAST_ID and end >= ANSWER_BYTES else None

    @override
    def is_whole(self, frame: bytes) -> bool:
        return checksum(frame[2:-1]) == frame[-1]


def decode_status(frame: bytes) -> Status | None:
    """A frame as an answer; None where it is addressed to all, as the echo of an instruction to many is."""
    return None if frame[2] > HIGHEST_ID else Status(frame[2], frame[4], frame[5:-1])
