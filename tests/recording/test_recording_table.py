import gc
import os
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.errors import RecordingError
from tauscope.recording.table import MemoryTable, SpooledTable, TableBuilder

NAMES = ("t", "q1", "tau1")


def blocks(sizes):
    data = np.random.default_rng(2).normal(size=(sum(sizes), len(NAMES)))
    return data, np.split(data, np.cumsum(sizes)[:-1])


@given(
    st.lists(st.integers(0, 700), min_size=1, max_size=12),
    st.integers(0, 5000),
    st.sampled_from([24, 2400, 24_000, 10**7]),
)
def test_spooled_and_kept_tables_hold_the_same_rows(sizes, expected_rows, limit):
    data, pieces = blocks(sizes)
    builder = TableBuilder(NAMES, expected_rows, limit)
    for piece in pieces:
        builder.append(piece)
    table = builder.finish()
    assert isinstance(table, SpooledTable if max(expected_rows, len(data)) * 24 > limit else MemoryTable)
    assert table.names == NAMES
    assert len(table) == len(builder) == len(data)
    for start, stop in ((0, len(data)), (1, 5), (len(data) - 1, len(data) + 9), (4, 4), (7, 3)):
        rows = table.rows(max(start, 0), stop)
        assert np.array_equal(rows, data[max(start, 0) : stop])
        assert not rows.flags.writeable


def test_spooled_rows_may_be_read_by_several_threads():
    data, _ = blocks([5000])
    table = SpooledTable(NAMES)
    table.append(data)
    with ThreadPoolExecutor(4) as pool:
        starts = list(range(0, 5000, 50))
        read = list(pool.map(lambda start: table.rows(start, start + 50), starts))
    assert np.array_equal(np.concatenate(read), data)


def test_a_spool_has_no_name_and_closes_with_its_table(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    before = len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").is_dir() else 0
    table = SpooledTable(NAMES)
    table.append(blocks([100])[0])
    assert list(tmp_path.iterdir()) == []
    del table
    gc.collect()
    assert not before or len(os.listdir("/proc/self/fd")) == before


def test_a_missing_temporary_folder_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
    with pytest.raises(RecordingError, match=r"gone cannot hold the recording \(No such file or directory\).*TMPDIR"):
        TableBuilder(NAMES, 1000, 24)


def test_a_full_disk_is_said(monkeypatch):
    builder = TableBuilder(NAMES, 1000, 24)

    def full(_self, _block):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(SpooledTable, "append", full)
    with pytest.raises(RecordingError, match="No space left on device"):
        builder.append(blocks([100])[0])
