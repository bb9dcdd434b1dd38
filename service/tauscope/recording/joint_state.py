"""The ROS 2 message sensor_msgs/msg/JointState: CDR bytes and JSON to arrays, and arrays to CDR bytes.

std_msgs/Header header {stamp {int32 sec, uint32 nanosec}, string frame_id}; string[] name;
float64[] position, velocity, effort. In CDR a number is aligned to its own size, counted from behind the four bytes of
the encapsulation header; a sequence or string is led by its length as uint32.

A publisher repeats one layout: same names, same lengths. `JointStateLayout` learns it from one message and then takes
whole batches as one array; a message with another layout is decoded by itself.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic_core import from_json

from tauscope.recording.samples import Array

_CDR_BIG_ENDIAN, _CDR_LITTLE_ENDIAN = 0, 1
_STAMP_AT = 4
_TRAILING_PADDING_BYTES = 7
_NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, eq=False)
class JointState:
    """One message; `position`, `velocity`, `effort`: (n,), empty where the publisher does not know them."""

    stamp: int
    names: tuple[str, ...]
    position: Array
    velocity: Array
    effort: Array


@dataclass(frozen=True, eq=False)
class JointStates:
    """Messages of one layout, one row a message."""

    stamp: NDArray[np.int64]  # (N,) int64, time of measurement [ns]
    names: tuple[str, ...]
    position: Array  # (N, n) or (N, 0), as are velocity and effort
    velocity: Array
    effort: Array


class JointStateLayout:
    """Where a publisher's messages keep what; learned from one message."""

    def __init__(self, message: bytes) -> None:
        """Learn the layout. Raises ValueError where it is no JointState."""
        cursor = CdrCursor(message)
        self.first = _decode(cursor)
        self._size = len(message)
        self._order = cursor.order
        self._arrays = cursor.arrays
        fixed = np.zeros(len(message), dtype=bool)
        for start, stop in cursor.fixed:
            fixed[start:stop] = True
        self._fixed_at = np.flatnonzero(fixed)
        self._fixed = np.frombuffer(message, np.uint8)[self._fixed_at]

    def decode(self, messages: Sequence[bytes]) -> JointStates | None:
        """Decode a batch at once; None where one of the messages has another layout."""
        if any(len(message) != self._size for message in messages):
            return None
        raw = np.frombuffer(b"".join(messages), np.uint8).reshape(len(messages), self._size)
        if not (raw[:, self._fixed_at] == self._fixed).all():
            return None
        seconds = self._column(raw, _STAMP_AT, "i4", 1)[:, 0].astype(np.int64)
        nanoseconds = self._column(raw, _STAMP_AT + 4, "u4", 1)[:, 0].astype(np.int64)
        arrays = (self._column(raw, at, "f8", count).astype(np.float64) for at, count in self._arrays)
        return JointStates(seconds * _NANOSECONDS + nanoseconds, self.first.names, *arrays)

    def _column(self, raw: NDArray[np.uint8], at: int, kind: str, count: int) -> NDArray[np.generic]:
        dtype = np.dtype(self._order + kind)
        block = np.ascontiguousarray(raw[:, at : at + count * dtype.itemsize])
        return block.view(dtype) if count else np.empty((len(raw), 0))


def decode_cdr(message: bytes) -> JointState:
    """Decode one CDR message. Raises ValueError where it is no JointState."""
    return _decode(CdrCursor(message))


def decode_json(message: bytes) -> JointState:
    """Decode JSON with the field names of the ROS 2 message. Raises ValueError where it is no JointState."""
    content = from_json(message)
    if not isinstance(content, dict):
        raise ValueError("the JSON message is not an object")
    header = content.get("header")
    stamp = header.get("stamp") if isinstance(header, dict) else None
    names = content.get("name") or []
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError("field name is not a list of joint names")
    arrays = [_json_array(content.get(field), field) for field in ("position", "velocity", "effort")]
    return JointState(json_stamp(stamp), tuple(names), *arrays)


def json_stamp(stamp: object) -> int:
    """Nanoseconds of a stamp, 0 where there is none."""
    if not isinstance(stamp, dict):
        return 0
    seconds, nanoseconds = stamp.get("sec", 0), stamp.get("nanosec", stamp.get("nsec", 0))
    if not (
        isinstance(seconds, int) and isinstance(nanoseconds, int) and abs(seconds) < 2**32 and 0 <= nanoseconds < 2**32
    ):
        raise ValueError("field header.stamp is not sec and nanosec")
    return seconds * _NANOSECONDS + nanoseconds


class CdrCursor:
    """Reads CDR primitives one after the other and notes where the numbers are and which bytes never change."""

    def __init__(self, message: bytes) -> None:
        if len(message) < _STAMP_AT + 8 or message[0] != 0 or message[1] not in (_CDR_BIG_ENDIAN, _CDR_LITTLE_ENDIAN):
            raise ValueError("the message is not plain CDR")
        self.message = message
        self.order = "<" if message[1] == _CDR_LITTLE_ENDIAN else ">"
        self.arrays: list[tuple[int, int]] = []
        self.fixed = [(0, 2)]
        self._at = _STAMP_AT

    def stamp(self) -> int:
        """Header stamp [ns]."""
        seconds, nanoseconds = struct.unpack_from(self.order + "iI", self.message, self._at)
        self._at += 8
        return seconds * _NANOSECONDS + nanoseconds

    def length(self) -> int:
        """A uint32; no sequence has more entries than there are bytes left."""
        self._align(4)
        stop = self._at + 4
        if stop > len(self.message):
            raise ValueError("the message ends early")
        (value,) = struct.unpack_from(self.order + "I", self.message, self._at)
        self.fixed.append((self._at, stop))
        self._at = stop
        if value > len(self.message) - self._at:
            raise ValueError("the message ends early")
        return value

    def string(self) -> str:
        """A string; its closing NUL is not part of it."""
        stop = self.length() + self._at
        value = self.message[self._at : stop].removesuffix(b"\0")
        self.fixed.append((self._at, stop))
        self._at = stop
        return value.decode("utf-8")

    def numbers(self) -> Array:
        """A sequence of numbers. Returns (n,), as the message has them."""
        count = self.length()
        if count:
            self._align(8)
        stop = self._at + 8 * count
        if stop > len(self.message):
            raise ValueError("the message ends early")
        values = np.frombuffer(self.message, self.order + "f8", count, self._at).astype(np.float64)
        self.arrays.append((self._at, count))
        self._at = stop
        return values

    def finish(self) -> None:
        """Refuse bytes behind the last field, but for padding."""
        if len(self.message) - self._at > _TRAILING_PADDING_BYTES:
            raise ValueError("the message is longer than a JointState")

    def _align(self, size: int) -> None:
        self._at += -(self._at - 4) % size


def _json_array(value: object, field: str) -> Array:
    """A list of numbers; null stands for NaN, which JSON cannot write."""
    if value is None:
        return np.empty(0)
    entries = value if isinstance(value, list) else [value]
    if not isinstance(value, list) or any(isinstance(entry, bool | str | list | dict) for entry in entries):
        raise ValueError(f"field {field} is not a list of numbers")
    return np.array([np.nan if entry is None else entry for entry in entries], dtype=np.float64)


def _decode(cursor: CdrCursor) -> JointState:
    stamp = cursor.stamp()
    cursor.string()  # frame_id
    names = tuple(cursor.string() for _ in range(cursor.length()))
    position, velocity, effort = (cursor.numbers() for _ in range(3))
    cursor.finish()
    return JointState(stamp, names, position, velocity, effort)


JOINT_STATE_DEFINITION = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""

_ENCAPSULATION = b"\x00\x01\x00\x00"
_STAMP = struct.Struct("<iI")


class JointStateEncoder:
    """Writes joint states of the same joints, message after message, into one template."""

    def __init__(self, names: Sequence[str], *, has_velocity: bool = True) -> None:
        message = bytearray(_ENCAPSULATION + bytes(_STAMP.size))
        _append_string(message, "")
        _append_length(message, len(names))
        for name in names:
            _append_string(message, name)
        counts = (len(names), len(names) if has_velocity else 0, len(names))
        places = [_append_numbers(message, count) for count in counts]
        self._message = message
        self._numbers = [np.frombuffer(message, "<f8", count, at) for count, at in zip(counts, places, strict=True)]

    def encode(self, stamp_ns: int, position: Array, velocity: Array | None, effort: Array | None) -> bytes:
        """One message of `position`, `velocity`, `effort`, (n,) each [SI]; None where the layout has none."""
        _STAMP.pack_into(self._message, len(_ENCAPSULATION), stamp_ns // _NANOSECONDS, stamp_ns % _NANOSECONDS)
        for target, values in zip(self._numbers, (position, velocity, effort), strict=True):
            if values is not None:
                target[:] = values
        return bytes(self._message)


def _append_length(message: bytearray, length: int) -> None:
    """A uint32, aligned to its own size behind the encapsulation header."""
    message.extend(bytes(-(len(message) - len(_ENCAPSULATION)) % 4))
    message.extend(struct.pack("<I", length))


def _append_string(message: bytearray, text: str) -> None:
    """Length with the closing NUL, text, NUL."""
    content = text.encode() + b"\0"
    _append_length(message, len(content))
    message.extend(content)


def _append_numbers(message: bytearray, count: int) -> int:
    """Room for a float64 sequence; where its numbers begin."""
    _append_length(message, count)
    if count:
        message.extend(bytes(-(len(message) - len(_ENCAPSULATION)) % 8))
    place = len(message)
    message.extend(bytes(8 * count))
    return place
