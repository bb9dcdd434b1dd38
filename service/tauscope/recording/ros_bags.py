"""Bags of ROS 1, and of ROS 2: a folder with metadata.yaml and its MCAP or SQLite files."""

import bz2
import sqlite3
import struct
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO
from urllib.parse import quote

import lz4.frame
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from tauscope.errors import RecordingError
from tauscope.extras import require_extra
from tauscope.recording.inflation import HELD_BYTES, LARGEST_RATIO, decompress_file, require_plausible_inflation
from tauscope.recording.joint_state_topic import JointStateLog
from tauscope.recording.mcap_format import add_mcap
from tauscope.remote_files import copy_locally
from tauscope.robot.messages import printable, reason

ROS1_MAGIC = b"#ROSBAG V2.0"

_CHUNK = b"\x05"
_LARGEST_CHUNK_BYTES = 2**28
_LARGEST_HEADER_BYTES = 2**16


def add_ros1_bag(path: Path, name: str, log: JointStateLog) -> None:
    """Add joint states by the bag's index. Raises MissingExtraError without rosbags, RecordingError where damaged."""
    with require_extra(f"{name}: a ROS 1 bag"):
        rosbag1: Any = import_module("rosbags.rosbag1")
    unreadable = (ValueError, KeyError, IndexError, EOFError, OSError, RuntimeError, MemoryError, struct.error)
    try:
        _require_plausible_chunks(path, name)
        with rosbag1.Reader(path) as reader:
            handlers = {
                each.id: log.handler(each.topic, each.msgtype.replace("/msg/", "/"), "ros1")
                for each in reader.connections
            }
            wanted = [each for each in reader.connections if handlers[each.id] is not None]
            for connection, time, message in reader.messages(connections=wanted) if wanted else ():
                handler = handlers[connection.id]
                if handler is not None:
                    handler(time, bytes(message))
    except RecordingError:
        raise
    except (rosbag1.ReaderError, *unreadable) as error:
        raise RecordingError(
            f"{name}: not a readable ROS 1 bag ({reason(error)}); run `rosbag reindex` on it"
        ) from error


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


SQLITE_MAGIC = b"SQLite format 3\0"
METADATA = "metadata.yaml"

_SQLITE_HEADER_BYTES = 100


def add_rosbag2(folder: Path, bag: str, log: JointStateLog) -> None:
    """Add a rosbag2 folder to a log, file by file. Raises RecordingError where a file is missing or damaged."""
    for file in _files(folder, bag):
        name = f"{bag}/{printable(file)}"
        path = folder / file
        if not path.is_file() and (folder / f"{file}.zstd").is_file():  # the names that rosbag2 wrote at first
            path = folder / f"{file}.zstd"
        if not path.is_file():
            raise RecordingError(f"{bag}: {METADATA} names {printable(file)}, which is not there")
        if path.suffix == ".zstd":
            with copy_locally(path) as copy, TemporaryDirectory(prefix="tauscope-") as temporary:
                _add_file(decompress_file(copy, Path(temporary) / path.stem, name), name, log)
        else:
            _add_file(path, name, log)


def _add_file(path: Path, name: str, log: JointStateLog) -> None:
    if path.suffix == ".mcap":
        add_mcap(path, name, log)
    elif path.suffix == ".db3":
        with copy_locally(path) as copy:
            add_database(copy, name, log)
    else:
        raise RecordingError(f"{name}: neither .mcap nor .db3; convert the bag with `ros2 bag convert` first")


def _files(folder: Path, name: str) -> list[str]:
    """The bag's files, by bare name: a bag never reaches out of its folder."""
    metadata = folder / METADATA
    if not metadata.is_file():
        way_out = "give the file itself, or run `ros2 bag reindex`"
        raise RecordingError(f"{name}: a folder without {METADATA} is no rosbag2 recording; {way_out}")
    try:
        content: Any = YAML(typ="safe", pure=True).load(metadata.read_text(encoding="utf-8"))
    except (YAMLError, ValueError, RecursionError) as error:
        raise RecordingError(f"{name}/{METADATA}: not a YAML file ({reason(error)})") from error
    except OSError as error:
        raise RecordingError(f"{name}/{METADATA}: cannot be read ({error.strerror})") from error
    try:
        files = [Path(file).name for file in content["rosbag2_bagfile_information"]["relative_file_paths"]]
    except (TypeError, KeyError) as error:
        raise RecordingError(
            f"{name}/{METADATA}: rosbag2_bagfile_information.relative_file_paths is missing; run `ros2 bag reindex`"
        ) from error
    if not files:
        raise RecordingError(f"{name}/{METADATA}: the bag has no files")
    return files


def add_database(path: Path, name: str, log: JointStateLog) -> None:
    """Add the joint states of one rosbag2 SQLite file to a log. Raises RecordingError where the file is damaged."""
    journal = path.with_name(path.name + "-wal")
    if journal.is_file() and journal.stat().st_size:
        raise RecordingError(
            f"{name}: was not closed ({journal.name} holds samples); run `ros2 bag reindex` on its folder"
        )
    _require_all_pages(path, name)
    try:
        # `immutable` keeps SQLite from making files beside it.
        connection = sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro&immutable=1", uri=True)
        try:
            (state,) = connection.execute("PRAGMA quick_check(1)").fetchone()
            if state != "ok":
                raise RecordingError(f"{name}: the database is damaged; run `ros2 bag reindex` or copy the file again")
            handlers = {}
            for number, topic, kind, encoding in connection.execute(
                "SELECT id, name, type, serialization_format FROM topics"
            ):
                handlers[number] = log.handler(str(topic), str(kind), str(encoding))
            wanted = {topic: handler for topic, handler in handlers.items() if handler is not None}
            marks = ", ".join("?" * len(wanted))  # images of other topics are not read
            for topic, time, message in connection.execute(
                f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY id",  # noqa: S608
                tuple(wanted),
            ):
                if not isinstance(message, bytes) or not isinstance(time, int) or time < 0:
                    raise RecordingError(f"{name}: the message at time {time!r} is damaged")
                wanted[topic](time, message)
        finally:
            connection.close()
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise RecordingError(f"{name}: not a readable rosbag2 database ({reason(error)})") from error


def _require_all_pages(path: Path, name: str) -> None:
    """Refuse a database that was cut short: SQLite itself would read what is left and say nothing."""
    with path.open("rb") as file:
        header = file.read(_SQLITE_HEADER_BYTES)
        size = file.seek(0, 2)
    if len(header) == _SQLITE_HEADER_BYTES and header.startswith(SQLITE_MAGIC):
        page_size, pages = int.from_bytes(header[16:18]), int.from_bytes(header[28:32])
        if size >= pages * (page_size if page_size > 1 else 2**16):
            return
    raise RecordingError(f"{name}: the database is truncated; copy the file again")
