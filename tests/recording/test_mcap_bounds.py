"""Small MCAP files that unpack to millions of records are refused before they cost time or memory."""

import struct
import time
from pathlib import Path

import pytest
import zstandard

from tauscope.errors import RecordingError
from tauscope.recording import read_recording
from tauscope.recording.mcap_format import MCAP_MAGIC

EMPTY_RECORD = struct.pack("<BQ", 0x80, 0)
SHORT_RECORD = struct.pack("<BQ", 0x80, 1) + b"x"


def write_chunk(path: Path, content: bytes) -> Path:
    """A file of one compressed chunk."""
    packed = zstandard.compress(content, 19)
    body = struct.pack("<QQQI", 0, 0, len(content), 0) + struct.pack("<I", 4) + b"zstd"
    body += struct.pack("<Q", len(packed)) + packed
    header = struct.pack("<II", 0, 0)
    path.write_bytes(MCAP_MAGIC + struct.pack("<BQ", 1, len(header)) + header + struct.pack("<BQ", 6, len(body)) + body)
    return path


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (EMPTY_RECORD * 7_000_000, "a record is empty"),
        (SHORT_RECORD * 6_000_000, "more than [0-9]+ records in so few bytes"),
        (struct.pack("<BQ", 0x80, 200_000_000) + bytes(200_000_000), "implausible chunk size"),
    ],
    ids=["empty", "short", "large"],
)
def test_a_bomb_is_refused_at_once(tmp_path: Path, content: bytes, words: str) -> None:
    path = write_chunk(tmp_path / "bomb.mcap", content)
    assert path.stat().st_size < 50_000
    began = time.process_time()
    with pytest.raises(RecordingError, match=words):
        read_recording(path)
    assert time.process_time() - began < 1.0
