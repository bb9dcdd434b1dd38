import sys

import numpy as np
import pytest

from recording.recording_files import arrays, message_of, rows_of, snapshot
from tauscope.errors import MissingExtraError, RecordingMismatchError
from tauscope.recording import read_recording
from tauscope.recording.column_files import read_parquet
from tauscope.recording.intake import Choice

pyarrow = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")


def columns(samples=40):
    motion = arrays(samples)
    table = {"t": motion["time"]}
    for prefix, field in (("q", "position"), ("tau", "effort")):
        for joint in (1, 2):
            table[f"{prefix}{joint}"] = motion[field][:, joint - 1]
    return table


def write(tmp_path, table, **options):
    path = tmp_path / "log.parquet"
    parquet.write_table(pyarrow.table(table), path, **options)
    return path


def test_the_columns_of_a_sound_file(tmp_path):
    path = write(tmp_path, {"note": ["x"] * 40, **columns()}, row_group_size=7)
    before = snapshot(tmp_path)
    recording = read_recording(path, 2)
    assert np.array_equal(rows_of(recording), np.column_stack(list(columns().values())))
    assert recording.ignored_columns == ("note",)
    assert snapshot(tmp_path) == before


def test_other_number_types_and_null(tmp_path):
    table = columns()
    table["q1"] = pyarrow.array([None, *range(39)], pyarrow.int32())
    table["q2"] = table["q2"].astype(np.float32)
    table["period"] = np.zeros(40, dtype=np.uint8)
    rows = rows_of(read_recording(write(tmp_path, table)))
    assert np.array_equal(rows[:, 1], [np.nan, *range(39)], equal_nan=True)
    assert np.array_equal(rows[:, 2], columns()["q2"].astype(np.float32))


def test_spooled_reading_gives_the_same_rows(tmp_path):
    path = write(tmp_path, columns(200_000))
    assert np.array_equal(
        rows_of(read_parquet(path, Choice("x", spool_above_bytes=1000))), rows_of(read_parquet(path, Choice("x")))
    )


def test_dates_become_seconds_from_the_first_row(tmp_path):
    stamps = (1_700_000_000_000 + np.arange(40)).astype("datetime64[ms]")
    samples = read_parquet(write(tmp_path, edited(t=stamps)), Choice("x")).samples()
    np.testing.assert_allclose(samples.time, np.arange(40) * 1e-3, atol=1e-12)
    durations = np.arange(40).astype("timedelta64[ms]")
    samples = read_parquet(write(tmp_path, edited(t=durations)), Choice("x")).samples()
    np.testing.assert_allclose(samples.time, np.arange(40) * 1e-3, atol=1e-12)


def edited(**changes):
    return {**columns(), **changes}


def time_with(row, value):
    time = columns()["t"].copy()
    time[row] = value
    return time


BAD = [
    (edited(t=time_with(19, 0.032)), "row 20, column t: time runs backwards: 0.032 s after 0.072"),
    (edited(t=time_with(9, np.nan)), "row 10, column t: the time is missing"),
    (edited(q1=np.full(40, np.inf)), "row 1, column q1: the value is infinite"),
    (edited(q1=["x"] * 40), "column q1 is of type string; numbers are needed"),
    (edited(tau2=[True] * 40), "column tau2 is of type bool; numbers are needed"),
    ({name: values for name, values in columns().items() if name != "tau2"}, "column tau2 is missing"),
    ({name: values[:3] for name, values in columns().items()}, "holds only 3 samples"),
]


@pytest.mark.parametrize(("table", "expected"), BAD, ids=[expected for _, expected in BAD])
def test_bad_files_are_refused_with_the_place(tmp_path, table, expected):
    path = write(tmp_path, table)
    message = message_of(lambda: read_recording(path))
    assert message.startswith(f"{path}: ")
    assert expected in message


def test_another_robots_recording(tmp_path):
    with pytest.raises(RecordingMismatchError, match="column q3 is missing"):
        read_recording(write(tmp_path, columns()), 3)


def test_truncated_and_damaged_files(tmp_path):
    path = write(tmp_path, columns())
    data = path.read_bytes()
    for length in (4, 5, 100, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:length])
        assert "not a readable Parquet file" in message_of(lambda: read_recording(path))


def test_a_missing_pyarrow_is_named(tmp_path, monkeypatch):
    path = write(tmp_path, columns())
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(MissingExtraError, match=r"log\.parquet: Parquet needs the parquet extra: pip install"):
        read_recording(path)
