"""Records and chunks of an MCAP file."""

import struct
from collections.abc import Mapping
from io import BytesIO
from typing import Protocol

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Schema
from mcap.stream_reader import get_chunk_data_stream

from tauscope.recording.inflation import HELD_BYTES, LARGEST_RATIO
from tauscope.recording.joint_state_log import MessageHandler

RECORD = struct.Struct("<BQ")
"""Opcode and length of a record."""

MESSAGE = struct.Struct("<HIQQ")
"""Channel, sequence, log time and publish time, in front of a message's bytes."""

UNREADABLE = (
    McapError,
    ValueError,
    struct.error,
    RuntimeError,
    EOFError,
    MemoryError,
    OverflowError,
    zstandard.ZstdError,
)
"""Errors that damaged records raise."""

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
    """Records within a chunk, their checksum compared.

    Raises ValueError where the chunk is damaged or implausibly large, among other errors of `UNREADABLE`.
    """
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
