"""A log with cameras: only what belongs to the joint states is read, and it is the same as by a walk over the file."""

import os
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from recording.recording_files import arrays, encoded_messages, message_of, messages, rows_of
from tauscope.errors import RecordingError
from tauscope.recording import read_recording
from tauscope.recording.intake import Choice
from tauscope.recording.joint_state_topic import JointStateLog
from tauscope.recording.mcap_format import scan_mcap

MOTION = arrays(400)
IMAGE = os.urandom(400_000)


def write_camera_log(path: Path, compression: CompressionType, *, mixes: bool) -> Path:
    """Joint states and images: in chunks of both, or images first and joint states behind them."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1_500_000, compression=compression)
        writer.start("ros2")
        states = writer.register_channel(
            "/joint_states", "cdr", writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
        )
        camera = writer.register_channel(
            "/camera", "cdr", writer.register_schema("sensor_msgs/msg/Image", "ros2msg", b"")
        )
        joint_states = encoded_messages(messages(400))
        images = [(joint_states[k][0], IMAGE) for k in range(0, 400, 20)]
        entries = [(time, states, data) for time, data in joint_states] + [(t, camera, data) for t, data in images]
        entries.sort(key=lambda entry: (entry[0], entry[1]) if mixes else (-entry[1], entry[0]))
        for time, channel, data in entries:
            writer.add_message(channel, time, data, time)
        writer.finish()
    return path


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD])
@pytest.mark.parametrize("mixes", [False, True])
def test_little_is_read_and_all_of_it_is_there(
    tmp_path: Path, compression: CompressionType, mixes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_camera_log(tmp_path / "log.mcap", compression, mixes=mixes)
    by_scan = JointStateLog(Choice(str(path)))
    assert scan_mcap(path, by_scan) is None
    read, pread = [], os.pread
    monkeypatch.setattr(os, "pread", lambda *words: read.append(words[1]) or pread(*words))
    recording = read_recording(path)
    assert np.array_equal(rows_of(recording), rows_of(by_scan.finish()))
    assert np.array_equal(recording.samples().position, MOTION["position"])
    if not mixes or compression is CompressionType.NONE:
        assert sum(read) < 0.05 * path.stat().st_size


def test_damage_in_an_image_does_not_matter_and_damage_of_the_joint_states_does(tmp_path: Path) -> None:
    path = write_camera_log(tmp_path / "log.mcap", CompressionType.ZSTD, mixes=False)
    sound, data = rows_of(read_recording(path)), bytearray(path.read_bytes())
    data[1_000_000] ^= 255
    path.write_bytes(data)
    assert np.array_equal(rows_of(read_recording(path)), sound)
    at = data.rindex(b"zstd", 0, len(data) - 3000) + 2000
    data[at] ^= 255
    path.write_bytes(data)
    message = message_of(lambda: read_recording(path))
    assert "the file is damaged" in message
    assert "before that point" in message


def test_a_damaged_index_is_not_believed(tmp_path: Path) -> None:
    path = write_camera_log(tmp_path / "log.mcap", CompressionType.NONE, mixes=True)
    sound, data = rows_of(read_recording(path)), path.read_bytes()
    rng, refusals = np.random.default_rng(7), []
    for at in rng.integers(len(data) - 1500, len(data) - 8, 60):
        damaged = bytearray(data)
        damaged[at] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            rows = rows_of(read_recording(path))
        except RecordingError as error:
            refusals.append(str(error))
        else:
            assert np.array_equal(rows, sound)
    assert all(refusal.startswith(f"{path}: ") for refusal in refusals)
