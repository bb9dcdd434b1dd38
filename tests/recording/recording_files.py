"""Small recordings, and ways to write them that do not go through the code under test."""

import sqlite3
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer as PlainWriter
from mcap_ros2._dynamic import serialize_dynamic
from mcap_ros2.writer import Writer

from tauscope.errors import RecordingError
from tauscope.recording import Recording

JOINT_STATE = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
===
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""


def arrays(samples: int = 40, joints: int = 2, seed: int = 1) -> dict[str, np.ndarray]:
    """A motion with time, position, effort and velocity."""
    rng = np.random.default_rng(seed)
    time = np.arange(samples) * 0.004
    position, effort, velocity = (rng.normal(size=(samples, joints)) for _ in range(3))
    return {"time": time, "position": position, "effort": effort, "velocity": velocity}


def csv_text(samples: int = 40, joints: int = 2, seed: int = 1) -> str:
    """A sound CSV recording."""
    motion = arrays(samples, joints, seed)
    header = ["t", *(f"{prefix}{joint}" for prefix in ("q", "tau") for joint in range(1, joints + 1))]
    rows = np.column_stack([motion["time"], motion["position"], motion["effort"]])
    return "\n".join([",".join(header), *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n"


def joint_state(
    time_ns: int,
    position: Sequence[float],
    effort: Sequence[float],
    velocity: Sequence[float] = (),
    names: Sequence[str] | None = None,
) -> dict:
    """One message as the mcap library's encoder takes it."""
    stamp = {"sec": time_ns // 10**9, "nanosec": time_ns % 10**9}
    names = [f"joint{k}" for k in range(1, len(position) + 1)] if names is None else list(names)
    header = {"stamp": stamp, "frame_id": "base"}
    return {
        "header": header,
        "name": names,
        "position": list(position),
        "velocity": list(velocity),
        "effort": list(effort),
    }


def messages(
    samples: int = 40, joints: int = 2, start_ns: int = 1_700_000_000_123_456_789, names: Sequence[str] | None = None
) -> list[tuple[int, dict]]:
    """A motion as messages with their log times; the log runs 1 ms late."""
    motion = arrays(samples, joints)
    stamps = [start_ns + 4_000_000 * k for k in range(samples)]
    rows = zip(stamps, motion["position"].tolist(), motion["effort"].tolist(), motion["velocity"].tolist(), strict=True)
    return [(stamp + 10**6, joint_state(stamp, q, tau, qd, names)) for stamp, q, tau, qd in rows]


def write_log(path: Path, topics: dict[str, list[tuple[int, dict]]], chunk_size: int = 2048) -> Path:
    """An MCAP file of JointState topics, by the library's own encoder."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk_size)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        entries = [(time, topic, message) for topic, log in topics.items() for time, message in log]
        for time, topic, message in sorted(entries, key=lambda entry: entry[0]):
            writer.write_message(topic, schema, message, log_time=time)
        writer.finish()
    return path


def write_plain_log(
    path: Path,
    encoded: Sequence[tuple[int, bytes]],
    *,
    encoding: str = "cdr",
    schema: str = "sensor_msgs/msg/JointState",
    schema_encoding: str = "ros2msg",
    topic: str = "/joint_states",
    **options: Any,
) -> Path:
    """An MCAP file of messages that are encoded already."""
    with path.open("wb") as file:
        writer = PlainWriter(file, **options)
        writer.start("ros2")
        schema_id = writer.register_schema(schema, schema_encoding, JOINT_STATE.encode())
        channel = writer.register_channel(topic, encoding, schema_id)
        for time, data in encoded:
            writer.add_message(channel, time, data, time)
        writer.finish()
    return path


def encoded_messages(log: Sequence[tuple[int, dict]]) -> list[tuple[int, bytes]]:
    """Messages in CDR, by the library's own encoder."""
    encode = serialize_dynamic("sensor_msgs/msg/JointState", JOINT_STATE)["sensor_msgs/msg/JointState"]
    return [(time, encode(message)) for time, message in log]


def write_database(path: Path, log: Sequence[tuple[int, dict]], topic: str = "/joint_states") -> Path:
    """A rosbag2 SQLite file as ROS 2 Humble lays it out."""
    connection = sqlite3.connect(path)
    connection.execute(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)"
    )
    connection.execute(
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
        "timestamp INTEGER NOT NULL, data BLOB NOT NULL)"
    )
    connection.execute("INSERT INTO topics VALUES(1, '/rosout', 'rcl_interfaces/msg/Log', 'cdr', '')")
    connection.execute("INSERT INTO topics VALUES(2, ?, 'sensor_msgs/msg/JointState', 'cdr', '')", (topic,))
    connection.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, 1, x'00010000')")
    connection.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES(2, ?, ?)", encoded_messages(log))
    connection.commit()
    connection.close()
    return path


def rows_of(recording: Recording) -> np.ndarray:
    """All rows of a recording's table."""
    return recording.table.rows(0, len(recording))


def message_of(call: Callable[[], object]) -> str:
    """The message of the RecordingError that a call raises, held to one line."""
    with pytest.raises(RecordingError) as caught:
        call()
    message = str(caught.value)
    assert message.isprintable(), repr(message)
    assert len(message) < 1000, message
    return message


def snapshot(folder: Path) -> dict[str, bytes]:
    """Names and contents of all files of a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def outcome(call: Callable[[], Recording]) -> SimpleNamespace:
    """What a call returned, or the message of the RecordingError that it raised."""
    try:
        recording = call()
    except RecordingError as error:
        message = str(error)
    else:
        return SimpleNamespace(message=None, rows=rows_of(recording), names=recording.table.names)
    assert message.isprintable(), repr(message)
    return SimpleNamespace(message=message, rows=None, names=None)


def every_cut(data: bytes, count: int) -> Iterator[int]:
    """Lengths to which a file may be cut short, evenly spread."""
    yield from sorted({int(length) for length in np.linspace(0, len(data) - 1, count)})
