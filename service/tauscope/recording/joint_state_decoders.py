"""Messages that hold joint states, by type and encoding: ROS 2, ROS 1, ros2_control and Foxglove."""

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from pydantic_core import from_json

from tauscope.recording.joint_state import CdrCursor, JointState, decode_cdr, decode_json, json_stamp
from tauscope.recording.samples import Array

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_NANOSECONDS = 1_000_000_000
_STATES = {"timestamp": 1, "joints": 2}
_STATE = {"name": 1, "position": 2, "velocity": 3, "acceleration": 4, "effort": 5}
_QUANTITIES = ("position", "velocity", "effort")
_NAN = struct.pack("<d", np.nan)

Value = int | bytes


def decode_foxglove_protobuf(schema: bytes) -> Callable[[bytes], JointState]:
    """The decoder of JointStates by a FileDescriptorSet, or by Foxglove's numbers. Both raise ValueError."""
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
        rows = {name: [_double(joint.get(number, _NAN)) for joint in joints] for number, name in wanted.items()}
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
    return [_require_bytes(value) for found, value in _fields(message) if found == number]


def _fields(message: bytes) -> Iterator[tuple[int, Value]]:
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
    value = shift = 0
    while True:
        if at >= len(message) or shift > 63:
            raise ValueError("the message ends early")
        value |= (message[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if not message[at - 1] & 0x80:
            return value, at


def _double(value: Value) -> float:
    return float(struct.unpack("<d", _require_bytes(value))[0])


def _require_bytes(value: Value) -> bytes:
    if isinstance(value, int):
        raise ValueError("a field has another wire type")
    return value


Decoder = Callable[[bytes], JointState]  # one message to a joint state; raises ValueError where it is none
JOINT_STATE_TYPES = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")

# Interfaces of ros2_control that serve as effort, the first that a joint has.
_EFFORTS = ("effort", "torque", "current")


def find_decoder(type_name: str, encoding: str, schema: bytes) -> Decoder | None:
    """The decoder of a topic's messages, None where they are no joint states; `schema` is empty where unknown."""
    if (type_name, encoding) == ("foxglove.JointStates", "protobuf"):
        return decode_foxglove_protobuf(schema)
    return _DECODERS.get((type_name, encoding))


def decode_ros1(message: bytes) -> JointState:
    """Decode sensor_msgs/JointState of ROS 1, unaligned, no closing NUL. Raises ValueError where it is none."""
    try:
        _, seconds, nanoseconds, length = struct.unpack_from("<IIII", message)
        at = 16 + length
        (count,) = struct.unpack_from("<I", message, at)
        at += 4
        names = []
        for _ in range(min(count, len(message))):
            (length,) = struct.unpack_from("<I", message, at)
            names.append(message[at + 4 : at + 4 + length].decode("utf-8"))
            at += 4 + length
        arrays = []
        for _ in range(3):
            (count,) = struct.unpack_from("<I", message, at)
            arrays.append(np.frombuffer(message, "<f8", count, at + 4).astype(np.float64))
            at += 4 + 8 * count
    except struct.error as error:
        raise ValueError("the message ends early") from error
    if at != len(message):
        raise ValueError("the message is longer than a JointState")
    return JointState(seconds * 10**9 + nanoseconds, tuple(names), *arrays)


def decode_dynamic(message: bytes) -> JointState:
    """Decode control_msgs/msg/DynamicJointState: each joint's named interfaces. Raises ValueError where it is none."""
    cursor = CdrCursor(message)
    stamp = cursor.stamp()
    cursor.string()  # frame_id
    names = tuple(cursor.string() for _ in range(cursor.length()))
    values: list[Mapping[str, float]] = []
    for _ in range(cursor.length()):
        interfaces = [cursor.string() for _ in range(cursor.length())]
        numbers = cursor.numbers()
        if len(interfaces) != len(numbers):
            raise ValueError("interface names and values differ in number")
        values.append(dict(zip(interfaces, numbers.tolist(), strict=True)))
    cursor.finish()
    if len(values) != len(names):
        raise ValueError("joint names and interface values differ in number")
    effort = next((name for name in _EFFORTS if any(name in joint for joint in values)), "effort")
    return JointState(stamp, names, *(_gather(values, field) for field in ("position", "velocity", effort)))


def decode_foxglove_json(message: bytes) -> JointState:
    """Decode foxglove.JointStates in JSON. Raises ValueError where it is no JointStates."""
    content = from_json(message)
    joints = content.get("joints") if isinstance(content, dict) else None
    if not isinstance(joints, list) or not all(isinstance(joint, dict) for joint in joints):
        raise ValueError("field joints is not a list of joints")
    names = [joint.get("name") for joint in joints]
    if not all(isinstance(name, str) for name in names):
        raise ValueError("a joint has no name")
    known = [
        {field: joint[field] for field in _QUANTITIES if type(joint.get(field)) in (int, float)} for joint in joints
    ]
    return JointState(
        json_stamp(content.get("timestamp")), tuple(names), *(_gather(known, field) for field in _QUANTITIES)
    )


def _gather(joints: Sequence[Mapping[str, float]], field: str) -> Array:
    """One number a joint, NaN where it has none; empty where no joint has one."""
    if not any(field in joint for joint in joints):
        return np.empty(0)
    return np.array([joint.get(field, np.nan) for joint in joints], dtype=np.float64)


_DECODERS: Mapping[tuple[str, str], Decoder] = {
    **{(name, "cdr"): decode_cdr for name in JOINT_STATE_TYPES},
    **{(name, "json"): decode_json for name in (*JOINT_STATE_TYPES, "JointState")},
    **{(name, "ros1"): decode_ros1 for name in JOINT_STATE_TYPES},
    ("control_msgs/msg/DynamicJointState", "cdr"): decode_dynamic,
    ("foxglove.JointStates", "json"): decode_foxglove_json,
}
