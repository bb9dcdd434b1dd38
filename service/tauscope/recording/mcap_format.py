"""Recordings as MCAP: joint states as ROS 2 logs them, or as JSON.

Where joint states are a small part of the file, its index leads to them. Otherwise the container is read record by
record from the front, so that a file without an index (the writer was killed) differs from a whole file only in how it
ends. Records and checksums are the mcap library's; the walk over a chunk's messages is our own, which is much quicker.
"""

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, Protocol

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, Schema, Statistics
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.summary import Summary

from tauscope.errors import RecordingError
from tauscope.recording.inflation import HELD_BYTES, LARGEST_RATIO, count_plausible_records, require_plausible_inflation
from tauscope.recording.intake import Choice
from tauscope.recording.joint_state_topic import JointStateLog, MessageHandler
from tauscope.recording.recording import Recording
from tauscope.recording.samples import MINIMUM_ROWS
from tauscope.remote_files import open_ranges, read_range
from tauscope.robot.messages import reason

RECORD = struct.Struct("<BQ")  # opcode and length of a record
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time and publish time, in front of a message's bytes

# Errors that damaged records raise.
UNREADABLE = (
    *(McapError, zstandard.ZstdError, struct.error),
    *(ValueError, RuntimeError, EOFError, MemoryError, OverflowError),
)

_LARGEST_CHUNK_BYTES = 2**28


class DamageError(Exception):
    """The container cannot be read further; the message completes "file: "."""


class MessageSink(Protocol):
    """Receiver of the messages of an MCAP file."""

    def handler(self, topic: str, type_name: str, encoding: str, schema: bytes = b"") -> MessageHandler | None:
        """The taker of a topic's messages, None where there is none."""
        ...


def find_handler(sink: MessageSink, channel: Channel, schemas: Mapping[int, Schema]) -> MessageHandler | None:
    """The taker of a channel's messages."""
    schema = schemas.get(channel.schema_id)
    name, data = ("", b"") if schema is None else (schema.name, schema.data)
    return sink.handler(channel.topic, name, channel.message_encoding, data)


def unpack_chunk(body: bytes) -> bytes:
    """Records within a chunk. Raises an error of `UNREADABLE` where it is damaged or implausibly large."""
    chunk = Chunk.read(ReadDataStream(BytesIO(body)))
    if chunk.compression not in ("", "zstd", "lz4"):
        raise ValueError(f"unknown compression {chunk.compression[:20]!r}")
    declared = [chunk.uncompressed_size]
    if chunk.compression == "zstd":
        # The frame states its own size and the decompressor believes it: look before it allocates.
        declared.append(max(zstandard.frame_content_size(chunk.data), 0))
    if max(declared) > min(_LARGEST_CHUNK_BYTES, max(HELD_BYTES, LARGEST_RATIO * len(body))):
        raise ValueError("implausible chunk size")
    stream, size = get_chunk_data_stream(chunk, validate_crc=True)
    return stream.read(size)


# Distance of wanted messages above which each is read by itself [bytes]: reading so far takes longer than a seek.
SEEK_BYTES = 2**15
MOST_SHARE = 0.5  # share of the file above which it is read as a whole, which compares every checksum
_MAGIC_BYTES = 8
_FOOTER = struct.Struct("<BQQQI")
_CHUNK_HEAD = struct.Struct("<QQQII")
_MESSAGE_INDEX = struct.Struct("<HI")  # channel, bytes of the entries behind it
_INDEX_ENTRY = struct.Struct("<QQ")


@dataclass(frozen=True)
class _Part:
    """Wanted messages of one chunk: offsets within it, in the order of the file."""

    chunk: ChunkIndex
    offsets: tuple[int, ...]

    @property
    def is_sparse(self) -> bool:
        """Whether each message is read by itself."""
        is_plain = self.chunk.compression == ""
        return is_plain and self.chunk.uncompressed_size > SEEK_BYTES * len(self.offsets)

    @property
    def read_bytes(self) -> int:
        """About how much is read of the file."""
        return SEEK_BYTES // 8 * len(self.offsets) if self.is_sparse else self.chunk.chunk_length


def read_by_index(file: BinaryIO, size: int, sink: MessageSink) -> bool:
    """Hand wanted messages over; False if most is wanted or the index unsound. Raises DamageError at bad chunks."""
    try:
        summary = _read_summary(file, size)
        if summary is None:
            return False
        handlers = {number: find_handler(sink, each, summary.schemas) for number, each in summary.channels.items()}
        wanted = {number for number, handler in handlers.items() if handler is not None}
        chunks = sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)
        parts = [_find_messages(file, size, chunk, wanted) for chunk in chunks]
    except UNREADABLE:
        return False
    counts = summary.statistics.channel_message_counts if summary.statistics else {}
    found = sum(len(part.offsets) for part in parts)
    is_whole = found == sum(count for number, count in counts.items() if number in wanted)
    if not is_whole or sum(part.read_bytes for part in parts if part.offsets) > MOST_SHARE * size:
        return False
    unpacked = 0
    for part in parts:
        if part.offsets:
            unpacked += 0 if part.is_sparse else part.chunk.uncompressed_size
            require_plausible_inflation(size, unpacked, "what was read so far")
            _read_part(file, part, handlers)
    return True


def _read_summary(file: BinaryIO, size: int) -> Summary | None:
    end = size - _MAGIC_BYTES - _FOOTER.size
    opcode, length, start, _, checksum = _FOOTER.unpack(_read(file, end, _FOOTER.size))
    if opcode != Opcode.FOOTER or length != _FOOTER.size - RECORD.size or not _MAGIC_BYTES <= start < end:
        return None
    data = _read(file, start, size - start)
    if checksum not in (0, zlib.crc32(data[: -4 - _MAGIC_BYTES])):
        return None
    summary = Summary()
    for record in StreamReader(BytesIO(data), skip_magic=True).records:
        if isinstance(record, Schema):
            summary.schemas[record.id] = record
        elif isinstance(record, Channel):
            summary.channels[record.id] = record
        elif isinstance(record, ChunkIndex):
            summary.chunk_indexes.append(record)
        elif isinstance(record, Statistics):
            summary.statistics = record
    statistics, chunks = summary.statistics, summary.chunk_indexes
    is_whole = statistics is not None and chunks and statistics.chunk_count == len(chunks)
    is_named = statistics is not None and set(statistics.channel_message_counts) <= set(summary.channels)
    return summary if is_whole and is_named else None


def _find_messages(file: BinaryIO, size: int, chunk: ChunkIndex, wanted: set[int]) -> _Part:
    offsets: list[int] = []
    if chunk.chunk_start_offset + chunk.chunk_length > size:
        raise ValueError("a chunk leaves the file")
    for channel, at in chunk.message_index_offsets.items():
        if channel not in wanted:
            continue
        opcode, length = RECORD.unpack(_read(file, at, RECORD.size))
        if opcode != Opcode.MESSAGE_INDEX or length > size - at:
            raise ValueError("no index of messages where one was stated")
        body = _read(file, at + RECORD.size, length)
        number, entries_bytes = _MESSAGE_INDEX.unpack_from(body)
        if number != channel or entries_bytes != len(body) - _MESSAGE_INDEX.size:
            raise ValueError("an index of messages that does not fill its record")
        offsets += [offset for _, offset in _INDEX_ENTRY.iter_unpack(body[_MESSAGE_INDEX.size :])]
    if len(set(offsets)) < len(offsets):
        raise ValueError("an index of messages lists one twice")
    return _Part(chunk, tuple(sorted(offsets)))


def _read_part(file: BinaryIO, part: _Part, handlers: Mapping[int, MessageHandler | None]) -> None:
    start, chunk = part.chunk.chunk_start_offset, part.chunk
    try:
        opcode, length = RECORD.unpack(_read(file, start, RECORD.size))
        if opcode != Opcode.CHUNK or length != chunk.chunk_length - RECORD.size:
            raise ValueError("no chunk where the index states one")
        if part.is_sparse:
            head = _read(file, start + RECORD.size, _CHUNK_HEAD.size)
            first = start + RECORD.size + _CHUNK_HEAD.size + _CHUNK_HEAD.unpack(head)[-1] + 8
            for offset in part.offsets:
                opcode, length = RECORD.unpack(_read(file, first + offset, RECORD.size))
                if length > chunk.uncompressed_size - offset:
                    raise ValueError("a record leaves its chunk")
                _hand_over(opcode, _read(file, first + offset + RECORD.size, length), handlers)
            return
        data = unpack_chunk(_read(file, start + RECORD.size, length))
        for offset in part.offsets:
            opcode, length = RECORD.unpack_from(data, offset)
            _hand_over(opcode, data[offset + RECORD.size : offset + RECORD.size + length], handlers)
    except UNREADABLE as error:
        raise DamageError(
            f"the file is damaged: the record at byte {start} cannot be read ({reason(error)})"
        ) from error


def _hand_over(opcode: int, record: bytes, handlers: Mapping[int, MessageHandler | None]) -> None:
    channel, _, log_time, _ = MESSAGE.unpack_from(record)
    handler = handlers.get(channel)
    if opcode != Opcode.MESSAGE or handler is None:
        raise ValueError("no message of the topic where the index states one")
    handler(log_time, record[MESSAGE.size :])


def _read(file: BinaryIO, at: int, length: int) -> bytes:
    data = read_range(file, at, length) if at >= 0 and length >= 0 else b""
    if len(data) < length:
        raise ValueError("the file ends early")
    return data


MCAP_MAGIC = b"\x89MCAP0\r\n"

_COPY_BYTES = 2**20


def add_mcap(path: Path, name: str, log: JointStateLog) -> None:
    """Add the messages of one whole file to a log. Raises RecordingError where the file is truncated or damaged."""
    damage = _read_whole(path, log)
    if damage is not None:
        samples = log.samples
        keeps = "`tauscope recording convert --recover` keeps them"
        way_out = keeps if samples >= MINIMUM_ROWS else "record or copy the file again"
        raise RecordingError(f"{name}: {damage}; {_count(samples)} before that point can be read: {way_out}")


def recover_mcap(path: Path, choice: Choice) -> tuple[Recording, str | None]:
    """What comes before the damage of an MCAP file, and the damage. Raises RecordingError where nothing does."""
    log = JointStateLog(choice)
    damage = scan_mcap(path, log)
    if damage is not None and log.samples < MINIMUM_ROWS:
        raise RecordingError(f"{choice.file}: {damage}; {_count(log.samples)} before that point: nothing to keep")
    return log.finish(), damage


def scan_mcap(path: Path, sink: MessageSink) -> str | None:
    """Hand the messages of an MCAP file over up to its end, or to its first damage, which is returned."""
    with path.open("rb") as file:
        try:
            _Scan(file, path.stat().st_size, sink).run()
        except DamageError as damage:
            return str(damage)
    return None


def _read_whole(path: Path, log: JointStateLog) -> str | None:
    """Read by the index, else from the front; the damage, None where there is none."""
    try:
        with open_ranges(path) as file:
            if read_by_index(file, path.stat().st_size, log):
                return None
    except DamageError as damage:
        return str(damage)
    return scan_mcap(path, log)


def _count(samples: int) -> str:
    return {0: "no sample", 1: "1 sample"}.get(samples, f"{samples} samples")


class _Scan:
    """One walk through an MCAP file."""

    def __init__(self, file: BinaryIO, size: int, sink: MessageSink) -> None:
        self._file, self._size, self._sink = file, size, sink
        self._checksum = self._unpacked_bytes = self._messages = self._records = 0
        self._schemas: dict[int, Schema] = {}
        self._handlers: dict[int, MessageHandler | None] = {}

    def run(self) -> None:
        """Walk up to the closing magic."""
        self._read(len(MCAP_MAGIC))
        while True:
            at, checksum = self._file.tell(), self._checksum
            opcode, length = RECORD.unpack(self._read(RECORD.size))
            if length > self._size - self._file.tell():
                raise DamageError(f"the file is truncated: it ends within the record at byte {at}")
            try:
                self._read_record(opcode, length, checksum)
            except UNREADABLE as error:
                place = f"the record at byte {at}"
                raise DamageError(f"the file is damaged: {place} cannot be read ({reason(error)})") from error
            if opcode == Opcode.FOOTER:
                break
        if self._file.read() != MCAP_MAGIC:
            raise DamageError("the file does not end as an MCAP file does")

    def _read_record(self, opcode: int, length: int, checksum: int) -> None:
        """Take what a record of the file holds. `checksum`: of the file up to the record."""
        if opcode == Opcode.CHUNK:
            self._walk_chunk(self._read(length))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            self._take(opcode, self._read(length), 0, length)
        elif opcode == Opcode.DATA_END:
            (expected,) = struct.unpack_from("<I", self._read(length))
            if expected not in (0, checksum):
                raise DamageError("the file is damaged: its data fail their checksum")
        elif opcode == Opcode.MESSAGE_INDEX:
            _, entries_bytes = _MESSAGE_INDEX.unpack_from(self._read(length))
            if entries_bytes != length - _MESSAGE_INDEX.size:  # a chunk that is taken for one
                raise ValueError("an index of messages that does not fill its record")
        elif opcode == Opcode.STATISTICS:
            (stated,) = struct.unpack_from("<Q", self._read(length))
            if stated != self._messages:  # a record whose kind was damaged was passed over as an unknown one
                raise DamageError(f"the file is damaged: it states {stated} messages and holds {self._messages}")
        else:  # of any size, in small memory; the checksum wants its bytes
            while length > 0:
                length -= len(self._read(min(length, _COPY_BYTES)))

    def _walk_chunk(self, body: bytes) -> None:
        data = unpack_chunk(body)
        self._unpacked_bytes += len(data)
        require_plausible_inflation(self._file.tell(), self._unpacked_bytes, "what was read so far")
        at, most_records = 0, count_plausible_records(self._file.tell())
        while at < len(data):
            opcode, length = RECORD.unpack_from(data, at)
            at += RECORD.size
            if not 0 < length <= len(data) - at:
                raise ValueError("a record is empty" if length == 0 else "a record leaves its chunk")
            self._records += 1
            if self._records > most_records:
                raise ValueError(f"more than {most_records} records in so few bytes")
            self._take(opcode, data, at, at + length)
            at += length

    def _take(self, opcode: int, data: bytes, start: int, stop: int) -> None:
        if opcode == Opcode.MESSAGE:
            channel, _, log_time, _ = MESSAGE.unpack_from(data, start)
            if stop - start < MESSAGE.size or channel not in self._handlers:
                raise ValueError("a message without a channel")
            self._messages += 1
            handler = self._handlers[channel]
            if handler is not None:
                handler(log_time, data[start + MESSAGE.size : stop])
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(BytesIO(data[start:stop])))
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(BytesIO(data[start:stop])))
            if channel.id not in self._handlers:
                self._handlers[channel.id] = find_handler(self._sink, channel, self._schemas)

    def _read(self, length: int) -> bytes:
        data = self._file.read(length)
        if len(data) < length:
            raise DamageError("the file is truncated: it ends without a footer")
        self._checksum = zlib.crc32(data, self._checksum)
        return data
