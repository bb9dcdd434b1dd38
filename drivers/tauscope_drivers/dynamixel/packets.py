"""Frames of Dynamixel Protocol 2.0 as bytes: pure functions and one parser, no port.

The library's own packet handler drops the error byte of group reads and stops at the first silent servo; here every
status packet is kept with its error byte, and no input is refused with anything but silence.
Source: ROBOTIS e-Manual, "Protocol 2.0".
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce

from typing_extensions import override

from tauscope_drivers.serial_servos.bus import FrameParser

HEADER = b"\xff\xff\xfd\x00"
BROADCAST_ID = 0xFE
HIGHEST_ID = 252

ALERT = 0x80  # bit of the error byte: the servo has a hardware error
LONGEST_FRAME = 1024  # frames that say to be longer are noise [bytes]

_PING, _READ, _WRITE, _CLEAR, _STATUS = 0x01, 0x02, 0x03, 0x10, 0x55
_ERROR_TO_CLEAR = b"\x02ERCL"
_SYNC_READ, _SYNC_WRITE, _FAST_SYNC_READ = 0x82, 0x83, 0x8A
_FIXED_BYTES = 7
_SHORTEST_FRAME = 10
_STUFFED, _PLAIN = b"\xff\xff\xfd\xfd", b"\xff\xff\xfd"


@dataclass(frozen=True)
class Status:
    """A status packet."""

    servo: int
    error: int
    data: bytes

    @property
    def alert(self) -> bool:
        """Whether the servo has a hardware error."""
        return bool(self.error & ALERT)

    @property
    def refusal(self) -> int:
        """Number of the error that the instruction met; 0 for none."""
        return self.error & ~ALERT & 0xFF


# CRC-16 of the polynomial x¹⁶ + x¹⁵ + x² + 1, most significant bit first, for each byte
_CRC = tuple(
    reduce(lambda crc, _: (crc << 1 ^ (0x8005 if crc & 0x8000 else 0)) & 0xFFFF, range(8), byte << 8)
    for byte in range(256)
)


def checksum(data: bytes | bytearray | memoryview, crc: int = 0) -> int:
    """CRC-16 (polynomial 0x8005, initial value 0) of a frame without its last two bytes."""
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC[crc >> 8 ^ byte]
    return crc


def encode_instruction(servo: int, instruction: int, parameters: bytes = b"") -> bytes:
    """A frame: header, ID, length, instruction and parameters with stuffing, CRC."""
    body = (bytes([instruction]) + parameters).replace(_PLAIN, _STUFFED)
    frame = HEADER + struct.pack("<BH", servo, len(body) + 2) + body
    return frame + struct.pack("<H", checksum(frame))


def encode_ping(servo: int = BROADCAST_ID) -> bytes:
    """Ask who is there."""
    return encode_instruction(servo, _PING)


def encode_clear_error(servo: int) -> bytes:
    """Let a servo of the Y series forget its error, without a restart; one whose cause persists refuses."""
    return encode_instruction(servo, _CLEAR, _ERROR_TO_CLEAR)


def encode_read(servo: int, address: int, length: int) -> bytes:
    """Read a stretch of a control table."""
    return encode_instruction(servo, _READ, struct.pack("<HH", address, length))


def encode_write(servo: int, address: int, data: bytes) -> bytes:
    """Write a stretch of a control table."""
    return encode_instruction(servo, _WRITE, struct.pack("<H", address) + data)


def encode_sync_read(servos: Sequence[int], address: int, length: int, *, fast: bool = False) -> bytes:
    """Read the same stretch of many servos."""
    parameters = struct.pack("<HH", address, length) + bytes(servos)
    return encode_instruction(BROADCAST_ID, _FAST_SYNC_READ if fast else _SYNC_READ, parameters)


def encode_sync_write(values: Mapping[int, bytes], address: int) -> bytes:
    """Write the same stretch of many servos at once; none of them answers."""
    length = len(next(iter(values.values())))
    if any(len(data) != length for data in values.values()):
        raise ValueError("a Sync Write carries the same number of bytes to every servo")
    parameters = struct.pack("<HH", address, length)
    return encode_instruction(
        BROADCAST_ID, _SYNC_WRITE, parameters + b"".join(bytes([servo]) + data for servo, data in values.items())
    )


class DynamixelParser(FrameParser):
    """Finds whole frames in what comes from a port, whatever it is."""

    header, fixed_bytes, longest = HEADER, _FIXED_BYTES, LONGEST_FRAME

    @override
    def find_end(self, start: bytearray) -> int | None:
        end = _FIXED_BYTES + (start[5] | start[6] << 8)
        return end if end >= _SHORTEST_FRAME else None

    @override
    def is_whole(self, frame: bytes) -> bool:
        return checksum(frame[:-2]) == frame[-2] | frame[-1] << 8


def decode_status(frame: bytes) -> Status | None:
    """A frame as a status packet of one servo; None where it is something else, such as the echo of an instruction."""
    if len(frame) <= _SHORTEST_FRAME or frame[_FIXED_BYTES] != _STATUS or frame[4] > HIGHEST_ID:
        return None
    body = frame[_FIXED_BYTES:-2].replace(_STUFFED, _PLAIN)
    return Status(frame[4], body[1], body[2:])


def decode_fast(frame: bytes, servos: Sequence[int], length: int) -> list[Status]:
    """Answers in a Fast Sync Read's packet, also in the beginning of one: those whose running checksum is right.

    Each servo appends error, ID, data and the checksum of everything before it; there is no stuffing. A servo that
    stays silent cuts the packet short, and those before it are still good.
    """
    found: list[Status] = []
    if not frame.startswith(HEADER + bytes([BROADCAST_ID])) or frame[_FIXED_BYTES : _FIXED_BYTES + 1] != b"\x55":
        return found
    crc, done = 0, 0
    start = _FIXED_BYTES + 1
    for servo in servos:
        end = start + 2 + length
        if len(frame) < end + 2:
            break
        crc = checksum(frame[done:end], crc)
        if crc != frame[end] | frame[end + 1] << 8 or frame[start + 1] != servo:
            break
        found.append(Status(servo, frame[start], frame[start + 2 : end]))
        crc, done, start = checksum(frame[end : end + 2], crc), end + 2, end + 2
    return found


# what an error number of a status packet means
REFUSALS = {
    0x01: "the instruction failed",
    0x02: "the instruction is not known to the servo",
    0x03: "the instruction arrived damaged",
    0x04: "the value is outside its range",
    0x05: "the data are shorter than the item",
    0x06: "the value is beyond a limit that the servo is set to",
    0x07: "the item cannot be written now (read-only, or torque is on)",
}
