"""Damaged files of every format: an error in one line, or exactly what the file says; never anything else."""

import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recording.recording_files import (
    csv_text,
    encoded_messages,
    messages,
    outcome,
    rows_of,
    snapshot,
    write_database,
    write_log,
    write_plain_log,
)
from tauscope.recording import check_recording, convert_recording, read_recording

COLUMNS = ("t", "q1", "q2", "tau1", "tau2")
CSV_LINES = csv_text(16).splitlines()
TOKENS = [
    "", "nan", "NaN", "abc", "1e400", "inf", "0x1", "1_0", "-", "1;2", "1,2", '"1"', "é", "\0", "\r", "#", " ", "+.5e1",
    "1e5", "-0", "q1", "tau1", "t", "tau9", "period", "temp2", "0.004", "-1", "s", "1.5 ", "\ufeff", "\u2028",
]  # fmt: skip


@st.composite
def mutated_csv(draw: st.DrawFn) -> bytes:
    """A sound file after one to three accidents."""
    lines = list(CSV_LINES)
    for _ in range(draw(st.integers(1, 3))):
        k, m = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        match draw(st.sampled_from(["delete", "double", "swap", "field", "field", "field", "insert", "drop column"])):
            case "delete" if len(lines) > 1:
                del lines[k]
            case "double":
                lines.insert(m, lines[k])
            case "swap":
                lines[k], lines[m] = lines[m], lines[k]
            case "insert":
                lines.insert(k, draw(st.sampled_from(["", "# comment", "s,rad,rad,Nm,Nm", ",,,,", "0.001,1,2,3,4"])))
            case "drop column":
                lines = [line.rpartition(",")[0] for line in lines]
            case _:
                fields = lines[k].split(",")
                fields[draw(st.integers(0, len(fields) - 1))] = draw(st.sampled_from(TOKENS))
                lines[k] = ",".join(fields)
    data = draw(st.sampled_from(["\n", "\n", "\r\n"])).join(lines).encode()
    return draw(mutated_bytes(data)) if draw(st.booleans()) else data


@st.composite
def mutated_bytes(draw: st.DrawFn, data: bytes) -> bytes:
    """A file after an accident that knows nothing of its format."""
    changed = bytearray(data)
    for _ in range(draw(st.integers(1, 2))):
        at = draw(st.integers(0, max(len(changed) - 1, 0)))
        match draw(st.sampled_from(["flip", "set", "cut", "remove", "repeat"])):
            case "flip" if changed:
                changed[at] ^= 1 << draw(st.integers(0, 7))
            case "set" if changed:
                changed[at] = draw(st.integers(0, 255))
            case "cut":
                del changed[at:]
            case "remove":
                del changed[at : at + draw(st.integers(1, 40))]
            case _:
                changed[at:at] = changed[at : at + draw(st.integers(1, 40))]
    return bytes(changed)


def expected_rows(data: bytes) -> np.ndarray | None:
    """What CONTRACT.md makes of a CSV file, read in the plainest way; None where it is no recording."""
    try:
        text = data.removeprefix(b"\xef\xbb\xbf").decode("utf-8")
    except UnicodeDecodeError:
        text = data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    lines = [line.rstrip("\r") for line in text.split("\n")]
    lines = [line for line in lines if line.strip(" \t\r\v\f") and not line.strip(" \t\r\v\f").startswith("#")]
    if not lines:
        return None
    lines = lines[first_line_of_names(lines) :]
    delimiter = next((mark for mark in ",;\t" if mark in lines[0]), ",")
    header = [name.strip(' \t\r"') for name in lines[0].split(delimiter)]
    if header == list(COLUMNS) and lines[1:2] == ["s,rad,rad,Nm,Nm"]:
        del lines[1]  # a row of units in SI
    rows = [line.split(delimiter) for line in lines[1:]]
    if not rows or any(header.count(name) != 1 for name in COLUMNS) or any(len(row) != len(header) for row in rows):
        return None
    try:
        table = np.array([[plain_number(row[header.index(name)]) for name in COLUMNS] for row in rows])
    except ValueError:
        return None
    if np.isnan(table[:, 0]).any():
        return None
    order = np.argsort(table[:, 0], kind="stable")
    is_late = np.abs(order - np.arange(len(order))).max(initial=0) > 8
    table = table[order]
    table = table[np.diff(table[:, 0], prepend=-np.inf) > 0]
    return table if len(table) >= 10 and not is_late else None


def first_line_of_names(lines: list[str]) -> int:
    """Lines before the names, with another number of fields than the first row of numbers, say something else."""

    def is_number(field: str) -> bool:
        try:
            plain_number(field)
        except ValueError:
            return False
        return bool(field.strip()) and "n" not in field.lower()

    rows = (
        k
        for k, line in enumerate(lines)
        if line.count(",") > 1 and 2 * sum(map(is_number, line.split(","))) > line.count(",") + 1
    )
    row = next(rows, 0)
    return next((k for k in range(row) if lines[k].count(",") == lines[row].count(",")), 0)


def plain_number(field: str) -> float:
    """A decimal number or NaN, after Python's own idea of them less what only Python allows."""
    field = field.strip(" \t")
    if len(field) > 2 and field[0] == field[-1] == '"':
        field = field[1:-1].strip(" \t")
    if not field:
        return np.nan
    if set(field) - set("0123456789+-.eEnaNA") or (not np.isfinite(float(field)) and "n" not in field.lower()):
        raise ValueError(field)
    return float(field)


def read_in_a_folder(name: str, data: bytes):
    """Read, check and convert a file; whatever comes of it, nothing in its folder may change."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        result = outcome(lambda: read_recording(path))
        assert snapshot(Path(folder)) == {name: data}
        if result.message is None:
            assert result.names is not None
            assert check_recording(path).samples == len(result.rows)
        else:
            assert result.message.startswith(str(path)), result.message
        return result


def csv_is_read_right_or_refused(data: bytes) -> None:
    result = read_in_a_folder("file.csv", data)
    expected = expected_rows(data)
    if result.rows is None:
        # Every file that is a recording with these five columns alone is read.
        assert expected is None or b"," not in data or not is_plain(data), result.message
    elif set(COLUMNS) <= set(result.names):
        assert expected is not None
        found = result.rows[:, [result.names.index(name) for name in COLUMNS]]
        assert np.array_equal(found, expected, equal_nan=True)


def is_plain(data: bytes) -> bool:
    """Whether the header holds the five columns only and the bytes are those of text."""
    header = next(line for line in data.decode("latin-1").split("\n") if line.strip() and not line.startswith("#"))
    return sorted(header.strip("\r").split(",")) == sorted(COLUMNS) and b"\0" not in data


@given(mutated_csv())
def test_mutated_csv(data):
    csv_is_read_right_or_refused(data)


@pytest.mark.proof
@settings(max_examples=2000)
@given(mutated_csv())
def test_many_mutated_csv(data):
    csv_is_read_right_or_refused(data)


def file_of(write) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return write(Path(folder) / "file.mcap").read_bytes()


MCAP = file_of(lambda path: write_log(path, {"/joint_states": messages(16)}, chunk_size=1024))


def mcap_is_read_right_or_refused(data: bytes) -> None:
    """Checksums cover all that matters, so that a file that still reads holds what it held."""
    result = read_in_a_folder("file.mcap", data)
    if result.rows is not None:
        assert np.array_equal(result.rows, sound_mcap_rows())


def sound_mcap_rows() -> np.ndarray:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.mcap"
        path.write_bytes(MCAP)
        return rows_of(read_recording(path))


def recovery_keeps_a_prefix(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.mcap"
        path.write_bytes(data)
        result = outcome(lambda: read_recording(convert_recording(path, path.with_suffix(".csv"), recover=True).target))
        assert path.read_bytes() == data
        if result.rows is not None:
            assert np.array_equal(result.rows, sound_mcap_rows()[: len(result.rows)])
        else:
            assert [file.name for file in Path(folder).iterdir()] == ["file.mcap"]


@given(mutated_bytes(MCAP))
def test_mutated_mcap(data):
    mcap_is_read_right_or_refused(data)


@given(mutated_bytes(MCAP))
def test_recovery_of_mutated_mcap(data):
    recovery_keeps_a_prefix(data)


@pytest.mark.proof
@settings(max_examples=2000)
@given(mutated_bytes(MCAP))
def test_many_mutated_mcap(data):
    mcap_is_read_right_or_refused(data)
    recovery_keeps_a_prefix(data)


CDR = encoded_messages(messages(12))
JSON = [(time, json.dumps(message).encode()) for time, message in messages(12)]


@given(st.integers(0, 11), st.sampled_from(["cdr", "json"]), st.data())
def test_mutated_messages_behind_sound_checksums(index, encoding, data):
    """The container cannot know that a message is broken; the decoder must."""
    encoded = list(CDR if encoding == "cdr" else JSON)
    encoded[index] = (encoded[index][0], data.draw(mutated_bytes(encoded[index][1])))
    read_in_a_folder("file.mcap", file_of(lambda path: write_plain_log(path, encoded, encoding=encoding)))


def sound_parquet() -> bytes:
    parquet = pytest.importorskip("pyarrow.parquet")
    pyarrow = pytest.importorskip("pyarrow")
    rows = np.array([[float(field) for field in line.split(",")] for line in CSV_LINES[1:]])
    table = pyarrow.table({name: rows[:, k] for k, name in enumerate(COLUMNS)})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.parquet"
        parquet.write_table(table, path, write_page_checksum=True)
        return path.read_bytes()


@given(st.data())
def test_mutated_parquet(data):
    read_in_a_folder("file.parquet", data.draw(mutated_bytes(sound_parquet())))


@pytest.mark.proof
@settings(max_examples=2000)
@given(st.data())
def test_many_mutated_parquet(data):
    read_in_a_folder("file.parquet", data.draw(mutated_bytes(sound_parquet())))


@given(st.binary(max_size=300), st.sampled_from(["file.csv", "file.mcap", "file.parquet", "file.db3", "file"]))
def test_any_bytes_at_all(data, name):
    assert read_in_a_folder(name, data).rows is None


DATABASE = file_of(lambda path: write_database(path, messages(14)))


@given(mutated_bytes(DATABASE))
def test_mutated_database(data):
    read_in_a_folder("file.db3", data)


@pytest.mark.proof
@settings(max_examples=2000)
@given(mutated_bytes(DATABASE))
def test_many_mutated_database(data):
    read_in_a_folder("file.db3", data)
