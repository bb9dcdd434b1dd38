"""Packed files are read as what is in them, whatever packed them."""

import bz2
import gzip
import io
import lzma
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard

from recording.layout_files import QD, TAU, TIME, Q, write
from recording.recording_files import message_of, rows_of
from tauscope.recording import read_recording
from tauscope.recording.reading import find_mapping

PACKERS = {".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress, ".zst": zstandard.compress}
HEADER = ["t", *(f"{group}{joint}" for group in ("q", "qd", "tau") for joint in (1, 2, 3))]


@pytest.mark.parametrize("suffix", PACKERS)
def test_a_packed_table_is_read(tmp_path: Path, suffix: str) -> None:
    plain = write(tmp_path / "log.csv", HEADER, np.column_stack([TIME, Q, QD, TAU]))
    packed = tmp_path / f"log.csv{suffix}"
    packed.write_bytes(PACKERS[suffix](plain.read_bytes()))
    found = read_recording(packed)
    assert np.array_equal(rows_of(found), rows_of(read_recording(plain)))
    assert found.name == str(packed)
    assert find_mapping(packed).header == find_mapping(plain).header


@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda packed, _: packed[:-20], "copy the file again"),
        (lambda packed, pack: pack(packed), "is compressed twice"),
        (lambda _, pack: pack(bytes(2**26)), "no recording packs so well"),
    ],
    ids=["truncated", "twice", "zeros"],
)
def test_what_is_no_packed_recording_is_refused(
    tmp_path: Path, suffix: str, spoil: Callable[[bytes, Callable[[bytes], bytes]], bytes], words: str
) -> None:
    plain = io.BytesIO()
    np.savez(plain, time=TIME, qpos=Q, qfrc_actuator=TAU)
    path = tmp_path / f"log.npz{suffix}"
    path.write_bytes(spoil(PACKERS[suffix](plain.getvalue()), PACKERS[suffix]))
    assert words in message_of(lambda: read_recording(path))
