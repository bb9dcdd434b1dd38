"""ROS 1 bags, written by rosbags."""

import struct
from pathlib import Path

import numpy as np
import pytest

from recording.recording_files import arrays, message_of
from recording.test_joint_state_decoders import NAMES, encode_all, ros1
from tauscope.recording import read_recording

rosbag1 = pytest.importorskip("rosbags.rosbag1")
typesys = pytest.importorskip("rosbags.typesys")
MOTION = arrays()


def write_bag(path: Path, compression: str = "") -> Path:
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    writer = rosbag1.Writer(path)
    if compression:
        writer.set_compression(rosbag1.Writer.CompressionFormat[compression])
    with writer:
        states = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        images = writer.add_connection("/camera", "std_msgs/msg/String", typestore=store)
        for time, message in encode_all(ros1):
            writer.write(images, time, b"\0\0\0\0")
            writer.write(states, time, message)
    return path


@pytest.mark.parametrize("compression", ["", "BZ2", "LZ4"])
def test_a_bag_is_read(tmp_path: Path, compression: str) -> None:
    path = write_bag(tmp_path / "file.bag", compression)
    samples = read_recording(path, joint_names=NAMES).samples()
    assert np.array_equal(samples.position, MOTION["position"])
    assert np.array_equal(samples.effort, MOTION["effort"])
    assert "the robot has 2 (a, b)" in message_of(lambda: read_recording(path, joint_names=("a", "b")))


def test_a_bag_that_was_cut_short_is_refused(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "file.bag")
    data = path.read_bytes()
    for length in np.linspace(20, len(data) - 1, 15).astype(int):
        path.write_bytes(data[:length])
        assert message_of(lambda: read_recording(path)).startswith(f"{path}: ")


def test_a_chunk_that_unpacks_to_more_than_it_states_is_refused(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "file.bag", "BZ2")
    data = path.read_bytes()
    at = data.index(b"size=", data.index(b"compression=bz2")) if b"size=" in data else 0
    path.write_bytes(data[: at + 5] + struct.pack("<I", 100) + data[at + 9 :])
    assert "a chunk is not as large as it states" in message_of(lambda: read_recording(path))
    path.write_bytes(data[: at + 5] + struct.pack("<I", 2**31) + data[at + 9 :])
    assert "times its size" in message_of(lambda: read_recording(path))
