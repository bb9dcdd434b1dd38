"""ROS 1 bags, by rosbags, which comes with the extra ``tauscope[ros1]``."""

import bz2
import struct
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

import lz4.frame

from tauscope.errors import RecordingError
from tauscope.recording.inflation import HELD_BYTES, LARGEST_RATIO, require_plausible_inflation
from tauscope.recording.joint_state_log import JointStateLog
from tauscope.recording.joint_state_topic import Choice
from tauscope.recording.recording import Recording
from tauscope.robot.messages import reason

ROS1_MAGIC = b"#ROSBAG V2.0"

_CHUNK = b"\x05"
_LARGEST_CHUNK_BYTES = 2**28
_LARGEST_HEADER_BYTES = 2**16


def read_ros1_bag(path: Path, choice: Choice) -> Recording:
    """Read the joint states of a ROS 1 bag; only chunks that hold messages of their topics are read.

    Raises RecordingError where rosbags is not installed, the bag is damaged or not indexed, or there are no usable
    joint states.
    """
    name = choice.file
    try:
        reader_type: Any = import_module("rosbags.rosbag1").Reader
        errors = import_module("rosbags.rosbag1").ReaderError
    except ImportError as error:
        raise RecordingError(
            f"{name}: ROS 1 bags need rosbags, which is not installed: pip install 'tauscope[ros1]'"
        ) from error
    log = JointStateLog(choice)
    try:
        _require_plausible_chunks(path, name)
        with reader_type(path) as reader:
            handlers = {
                each.id: log.handler(each.topic, _ros1_name(each.msgtype), "ros1") for each in reader.connections
            }
            wanted = [each for each in reader.connections if handlers[each.id] is not None]
            for connection, time, message in reader.messages(connections=wanted) if wanted else ():
                handler = handlers[connection.id]
                if handler is not None:
                    handler(time, bytes(message))
    except RecordingError:
        raise
    except (
        errors,
        ValueError,
        KeyError,
        IndexError,
        EOFError,
        OSError,
        RuntimeError,
        MemoryError,
        struct.error,
    ) as error:
        raise RecordingError(
            f"{name}: not a readable ROS 1 bag ({reason(error)}); run `rosbag reindex` on it"
        ) from error
    return log.finish()


def _ros1_name(type_name: str) -> str:
    """The type as ROS 1 names it."""
    return type_name.replace("/msg/", "/")


def _require_plausible_chunks(path: Path, name: str) -> None:
    """Refuse chunks that unpack to more than they state, or to implausibly much: rosbags has no limit."""
    unpacked, size = 0, path.stat().st_size
    with path.open("rb") as file:
        file.readline(64)
        for header, length in _records(file, size):
            if header.get(b"op") != _CHUNK:
                continue
            (stated,) = struct.unpack("<I", header[b"size"])
            unpacked += stated
            require_plausible_inflation(size, unpacked, name)
            if stated > min(_LARGEST_CHUNK_BYTES, max(HELD_BYTES, LARGEST_RATIO * length)):
                raise ValueError("implausible chunk size")
            at = file.tell()
            kind = header.get(b"compression", b"none")
            if kind != b"none":
                unpacker = bz2.BZ2Decompressor() if kind == b"bz2" else lz4.frame.LZ4FrameDecompressor()
                if len(unpacker.decompress(file.read(length), stated + 1)) != stated:
                    raise ValueError("a chunk is not as large as it states")
            file.seek(at)


def _records(file: BinaryIO, size: int) -> Iterator[tuple[dict[bytes, bytes], int]]:
    """Header of every record and the length of its data, which the file is then at."""
    while file.tell() < size:
        (length,) = struct.unpack("<I", file.read(4))
        if length > _LARGEST_HEADER_BYTES:
            raise ValueError("implausible record header")
        header, at = file.read(length), 0
        fields = {}
        while at < len(header):
            (count,) = struct.unpack_from("<I", header, at)
            key, _, value = header[at + 4 : at + 4 + count].partition(b"=")
            fields[key] = value
            at += 4 + count
        (length,) = struct.unpack("<I", file.read(4))
        start = file.tell()
        yield fields, length
        file.seek(start + length)
