"""foxglove.JointStates in protobuf: numbers of its fields from the schema that the log carries."""

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from tauscope.recording.joint_state import JointState

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_NANOSECONDS = 1_000_000_000
_STATES = {"timestamp": 1, "joints": 2}
_STATE = {"name": 1, "position": 2, "velocity": 3, "acceleration": 4, "effort": 5}
_QUANTITIES = ("position", "velocity", "effort")

Value = int | bytes


def decode_foxglove_protobuf(schema: bytes) -> Callable[[bytes], JointState]:
    """The decoder of a log's messages.

    Raises ValueError where the schema cannot be read; so does the decoder where a message is no JointStates.

    `schema`: FileDescriptorSet of the type; empty for the numbers that Foxglove publishes.
    """
    numbers = _field_numbers(schema)
    states, state = numbers.get("JointStates", _STATES), numbers.get("JointState", _STATE)
    wanted = {state[name]: name for name in _QUANTITIES if name in state}

    def decode(message: bytes) -> JointState:
        stamp, joints = 0, []
        for number, value in _fields(message):
            if number == states["timestamp"]:
                time = dict(_fields(_require_bytes(value)))
                stamp = int(time.get(1, 0)) * _NANOSECONDS + int(time.get(2, 0))
            elif number == states["joints"]:
                joints.append(dict(_fields(_require_bytes(value))))
        names = tuple(_require_bytes(joint.get(state["name"], b"")).decode("utf-8") for joint in joints)
        rows = {name: [_double(joint.get(number)) for joint in joints] for number, name in wanted.items()}
        arrays = (np.array(rows.get(name, ()), dtype=np.float64) for name in _QUANTITIES)
        return JointState(stamp, names, *(array if np.isfinite(array).any() else np.empty(0) for array in arrays))

    return decode


def _field_numbers(schema: bytes) -> Mapping[str, Mapping[str, int]]:
    """Number of each field, by message, of a FileDescriptorSet (its fields by number: descriptor.proto)."""
    found: dict[str, dict[str, int]] = {}
    for file in _all(schema, 1):
        for message in _all(file, 4):
            name = b"".join(_all(message, 1)).decode("utf-8")
            fields = [dict(_fields(field)) for field in _all(message, 2)]
            found[name] = {_require_bytes(field.get(1, b"")).decode("utf-8"): int(field.get(3, 0)) for field in fields}
    return found


def _all(message: bytes, number: int) -> Sequence[bytes]:
    """All values of a field."""
    return [_require_bytes(value) for found, value in _fields(message) if found == number]


def _fields(message: bytes) -> Iterator[tuple[int, Value]]:
    """Fields of a message in the wire format: number and value."""
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        kind = key & 7
        if kind == _VARINT:
            value, at = _varint(message, at)
            yield key >> 3, value
            continue
        if kind == _BYTES:
            length, at = _varint(message, at)
        elif kind in (_FIXED64, _FIXED32):
            length = 8 if kind == _FIXED64 else 4
        else:
            raise ValueError(f"wire type {kind} is not known")
        if length > len(message) - at:
            raise ValueError("the message ends early")
        yield key >> 3, message[at : at + length]
        at += length


def _varint(message: bytes, at: int) -> tuple[int, int]:
    """A number of variable length, and where it ends."""
    value = shift = 0
    while True:
        if at >= len(message) or shift > 63:
            raise ValueError("the message ends early")
        value |= (message[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if not message[at - 1] & 0x80:
            return value, at


def _double(value: Value | None) -> float:
    """A float64; NaN where the field is absent."""
    if value is None:
        return np.nan
    return float(struct.unpack("<d", _require_bytes(value))[0])


def _require_bytes(value: Value) -> bytes:
    """A field of bytes."""
    if isinstance(value, int):
        raise ValueError("a field has another wire type")
    return value
