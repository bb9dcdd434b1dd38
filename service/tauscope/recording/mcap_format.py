"""Recordings as MCAP: joint states as ROS 2 logs them, or as JSON.

Where joint states are a small part of the file, its index leads to them. Otherwise the container is read record by
record from the front, so that a file without an index (the writer was killed) differs from a whole file only in how it
ends. Records and checksums are the mcap library's; the walk over a chunk's messages is our own, which is much quicker.
"""

import os
import struct
import zlib
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from tauscope.errors import RecordingError
from tauscope.recording.inflation import count_plausible_records, require_plausible_inflation
from tauscope.recording.joint_state_log import JointStateLog, MessageHandler
from tauscope.recording.joint_state_topic import Choice
from tauscope.recording.mcap_index import (
    MESSAGE,
    RECORD,
    UNREADABLE,
    DamageError,
    MessageSink,
    find_handler,
    read_by_index,
    unpack_chunk,
)
from tauscope.recording.recording import Recording
from tauscope.recording.row_check import MINIMUM_ROWS
from tauscope.robot.messages import reason

MCAP_MAGIC = b"\x89MCAP0\r\n"

_MESSAGE_INDEX = struct.Struct("<HI")
_COPY_BYTES = 2**20


@dataclass(frozen=True)
class Salvage:
    """What was read of a file that may be damaged.

    `damage`: why reading stopped, None where the file is whole.
    """

    recording: Recording
    damage: str | None


def read_mcap(path: Path, choice: Choice) -> Recording:
    """Read the joint states of an MCAP file.

    Raises RecordingError where the file is truncated or damaged, or holds no usable joint states.
    """
    log = JointStateLog(choice)
    add_mcap(path, choice.file, log)
    return log.finish()


def add_mcap(path: Path, name: str, log: JointStateLog) -> None:
    """Add the messages of one whole file to a log. Raises RecordingError where the file is truncated or damaged."""
    damage = _read_whole(path, log)
    if damage is not None:
        samples = log.samples
        keeps = "`tauscope recording convert --recover` keeps them"
        way_out = keeps if samples >= MINIMUM_ROWS else "record or copy the file again"
        raise RecordingError(f"{name}: {damage}; {_count(samples)} before that point can be read: {way_out}")


def recover_mcap(path: Path, choice: Choice) -> Salvage:
    """Read a damaged MCAP file up to the damage. Raises RecordingError where nothing usable comes before the damage."""
    log = JointStateLog(choice)
    damage = scan_mcap(path, log)
    if damage is not None and log.samples < MINIMUM_ROWS:
        raise RecordingError(f"{choice.file}: {damage}; {_count(log.samples)} before that point: nothing to keep")
    return Salvage(log.finish(), damage)


def scan_mcap(path: Path, sink: MessageSink) -> str | None:
    """Hand the messages of an MCAP file over, in the order of the file, up to its end or its first damage.

    Returns str or None: why reading stopped before the file's end, None where it is whole.
    """
    with path.open("rb") as file:
        try:
            _Scan(file, os.fstat(file.fileno()).st_size, sink).run()
        except DamageError as damage:
            return str(damage)
    return None


def _read_whole(path: Path, log: JointStateLog) -> str | None:
    """Read by the index, else from the front; the damage, None where there is none."""
    try:
        with path.open("rb") as file:
            if read_by_index(file, os.fstat(file.fileno()).st_size, log):
                return None
    except DamageError as damage:
        return str(damage)
    return scan_mcap(path, log)


def _count(samples: int) -> str:
    """A count of samples in words."""
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
                if opcode == Opcode.CHUNK:
                    self._walk_chunk(self._read(length))
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
                    body = self._read(length)
                    self._take(opcode, body, 0, len(body))
                elif opcode == Opcode.DATA_END:
                    (expected,) = struct.unpack_from("<I", self._read(length))
                    if expected not in (0, checksum):
                        raise DamageError("the file is damaged: its data fail their checksum")
                elif opcode == Opcode.MESSAGE_INDEX:
                    _require_filled(self._read(length))
                elif opcode == Opcode.STATISTICS:
                    self._require_all(*struct.unpack_from("<Q", self._read(length)))
                else:
                    self._skip(length)
            except UNREADABLE as error:
                place = f"the record at byte {at}"
                raise DamageError(f"the file is damaged: {place} cannot be read ({reason(error)})") from error
            if opcode == Opcode.FOOTER:
                break
        if self._file.read() != MCAP_MAGIC:
            raise DamageError("the file does not end as an MCAP file does")

    def _require_all(self, stated: int) -> None:
        """A record whose kind was damaged is passed over as one that is not known: its messages are missed here."""
        if stated != self._messages:
            raise DamageError(f"the file is damaged: it states {stated} messages and holds {self._messages}")

    def _walk_chunk(self, body: bytes) -> None:
        """Walk the records within a chunk."""
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
        """Take one record of the data section."""
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

    def _skip(self, length: int) -> None:
        """Pass over a record of any size in small memory; the checksum wants its bytes."""
        while length > 0:
            length -= len(self._read(min(length, _COPY_BYTES)))


def _require_filled(index: bytes) -> None:
    """An index of messages is as long as it says; a chunk that is taken for one is not."""
    _, entries_bytes = _MESSAGE_INDEX.unpack_from(index)
    if entries_bytes != len(index) - _MESSAGE_INDEX.size:
        raise ValueError("an index of messages that does not fill its record")
