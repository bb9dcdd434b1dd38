"""Joint states in the messages of ROS 1, ros2_control and Foxglove, and in compressed messages."""

import json
import struct
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer
from mcap_ros2._dynamic import serialize_dynamic

from recording.recording_files import arrays, encoded_messages, message_of, messages, write_plain_log
from tauscope.recording import Recording, read_recording
from tauscope.recording.joint_state_decoders import (
    decode_dynamic,
    decode_foxglove_json,
    decode_foxglove_protobuf,
    decode_ros1,
)

NAMES = ("lift", "elbow")
MOTION = arrays()
DYNAMIC = """\
std_msgs/Header header
string[] joint_names
control_msgs/InterfaceValue[] interface_values
===
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
===
MSG: control_msgs/InterfaceValue
string[] interface_names
float64[] values
"""
Encode = Callable[[int, Sequence[float], Sequence[float]], bytes]


def ros1(stamp: int, q: Sequence[float], tau: Sequence[float]) -> bytes:
    names = b"".join(struct.pack("<I", len(name)) + name.encode() for name in NAMES)
    numbers = [struct.pack(f"<I{len(v)}d", len(v), *v) for v in (q, (), tau)]
    header = struct.pack("<IIII", 7, stamp // 10**9, stamp % 10**9, 4) + b"base"
    return header + struct.pack("<I", len(NAMES)) + names + b"".join(numbers)


def dynamic(stamp: int, q: Sequence[float], tau: Sequence[float]) -> bytes:
    kind = "control_msgs/msg/DynamicJointState"
    values = [
        {"interface_names": ["effort", "position", "temperature"], "values": [e, p, 30.0]}
        for p, e in zip(q, tau, strict=True)
    ]
    header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "b"}
    message = {
        "header": header,
        "joint_names": [*NAMES, "gripper"],
        "interface_values": [*values, {"interface_names": ["position"], "values": [0.1]}],
    }
    return serialize_dynamic(kind, DYNAMIC)[kind](message)


def foxglove_json(stamp: int, q: Sequence[float], tau: Sequence[float]) -> bytes:
    joints = [{"name": n, "position": p, "effort": e} for n, p, e in zip(NAMES, q, tau, strict=True)]
    return json.dumps({"timestamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9}, "joints": joints}).encode()


def varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def field(number: int, value: int | bytes | float) -> bytes:
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    if isinstance(value, float):
        return varint(number << 3 | 1) + struct.pack("<d", value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def foxglove_protobuf(stamp: int, q: Sequence[float], tau: Sequence[float], effort: int = 5) -> bytes:
    time = field(1, field(1, stamp // 10**9) + field(2, stamp % 10**9))
    joints = [field(1, n.encode()) + field(2, p) + field(effort, e) for n, p, e in zip(NAMES, q, tau, strict=True)]
    return time + b"".join(field(2, joint) for joint in joints)


def descriptor(effort: int) -> bytes:
    """A FileDescriptorSet in which the effort has another number."""

    def message(kind: str, **numbers: int) -> bytes:
        fields = [field(2, field(1, key.encode()) + field(3, number)) for key, number in numbers.items()]
        return field(4, field(1, kind.encode()) + b"".join(fields))

    state = message("JointState", name=1, position=2, velocity=3, effort=effort)
    return field(1, field(1, b"foxglove.proto") + state + message("JointStates", timestamp=1, joints=2))


KINDS: dict[str, tuple[str, str, Encode]] = {
    "ROS 1": ("sensor_msgs/JointState", "ros1", ros1),
    "ros2_control": ("control_msgs/msg/DynamicJointState", "cdr", dynamic),
    "Foxglove in JSON": ("foxglove.JointStates", "json", foxglove_json),
    "Foxglove in protobuf": ("foxglove.JointStates", "protobuf", foxglove_protobuf),
}


def encode_all(encode: Encode) -> list[tuple[int, bytes]]:
    stamps = [10**18 + 4_000_000 * k for k in range(len(MOTION["time"]))]
    rows = zip(stamps, MOTION["position"].tolist(), MOTION["effort"].tolist(), strict=True)
    return [(stamp + 10**6, encode(stamp, q, tau)) for stamp, q, tau in rows]


def require_motion(recording: Recording) -> None:
    samples = recording.samples()
    assert np.allclose(samples.time, MOTION["time"], atol=1e-9)
    assert np.array_equal(samples.position, MOTION["position"][:, ::-1])
    assert np.array_equal(samples.effort, MOTION["effort"][:, ::-1])
    assert recording.notes == ()


@pytest.mark.parametrize("kind", KINDS)
def test_messages_are_read(tmp_path: Path, kind: str) -> None:
    schema, encoding, encode = KINDS[kind]
    path = write_plain_log(tmp_path / "log.mcap", encode_all(encode), encoding=encoding, schema=schema)
    if encoding == "protobuf":
        path = write_protobuf(tmp_path / "log.mcap", encode_all(encode), b"")
    require_motion(read_recording(path, joint_names=NAMES[::-1]))


def write_protobuf(path: Path, encoded: Sequence[tuple[int, bytes]], schema: bytes) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        kind = writer.register_schema("foxglove.JointStates", "protobuf", schema)
        channel = writer.register_channel("/joint_states", "protobuf", kind)
        for time, data in encoded:
            writer.add_message(channel, time, data, time)
        writer.finish()
    return path


def test_numbers_of_protobuf_fields_come_from_the_schema(tmp_path: Path) -> None:
    encoded = encode_all(lambda stamp, q, tau: foxglove_protobuf(stamp, q, tau, effort=9))
    path = write_protobuf(tmp_path / "log.mcap", encoded, descriptor(9))
    require_motion(read_recording(path, joint_names=NAMES[::-1]))


def test_ros2_control_publishes_both_kinds(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        for topic, kind, encoded in (
            ("/ur/dynamic_joint_states", "control_msgs/msg/DynamicJointState", encode_all(dynamic)),
            ("/ur/joint_states", "sensor_msgs/msg/JointState", encoded_messages(messages(names=NAMES))),
        ):
            channel = writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", b""))
            for time, data in encoded:
                writer.add_message(channel, time, data, time)
        writer.finish()
    require_motion(read_recording(path, joint_names=NAMES[::-1]))
    assert read_recording(path, joint_names=NAMES).has("qd")


def test_compressed_messages_are_read(tmp_path: Path) -> None:
    compress = zstandard.ZstdCompressor().compress
    encoded = [(time, compress(data)) for time, data in encoded_messages(messages(names=NAMES))]
    require_motion(read_recording(write_plain_log(tmp_path / "log.mcap", encoded), joint_names=NAMES[::-1]))
    broken = [(time, data[:-3]) for time, data in encoded]
    message = message_of(lambda: read_recording(write_plain_log(tmp_path / "log.mcap", broken)))
    assert "message 1: not a JointState message (the compressed message is damaged" in message
    huge = [(5, zstandard.ZstdCompressor().compress(bytes(2**18)))]
    message = message_of(lambda: read_recording(write_plain_log(tmp_path / "log.mcap", huge)))
    assert "larger than any joint state" in message


DECODERS = (decode_ros1, decode_dynamic, decode_foxglove_json, decode_foxglove_protobuf(b""))


@given(data=st.binary(max_size=300), which=st.sampled_from(range(4)))
def test_any_bytes_are_read_or_refused(data: bytes, which: int) -> None:
    with suppress(ValueError, OverflowError):
        DECODERS[which](data)


@given(cut=st.integers(0, 80), at=st.integers(0, 200), byte=st.integers(0, 255), which=st.sampled_from(range(4)))
def test_damaged_messages_are_read_or_refused(cut: int, at: int, byte: int, which: int) -> None:
    encode = (ros1, dynamic, foxglove_json, foxglove_protobuf)[which]
    data = bytearray(encode(10**18, [1.0, 2.0], [3.0, 4.0]))
    data[at % len(data)] = byte
    with suppress(ValueError, OverflowError):
        DECODERS[which](bytes(data[: len(data) - cut]))
