import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recording.recording_files import outcome
from tauscope.recording import csv_dialect
from tauscope.recording.csv_dialect import parse_quickly
from tauscope.recording.csv_format import read_csv
from tauscope.recording.intake import Choice

TRICKY = [
    "0", "-0", "-0.0", "+1.5", ".5", "-.5", "5.", "007", "1e5", "1E+05", "1e-400", "1e308", "1.7976931348623157e308",
    "5e-324", "2.2250738585072011e-308", "9007199254740993", "9007199254740993.0", "123456789012345678901234567890",
    "0.1000000000000000055511151231257827021181583404541015625", "", " ", "nan", "NaN", "NAN", "-nan", " 1.5 ", "\t2",
    "1e400", "-1e400", "9" * 400, "inf", "-inf", "Infinity", "0x10", "1_0", "1e", "e5", "--1", "+-1", "1-2", ".", "-",
    "+", "1 2", "1.2.3", "nan1", "aN", "true", "null", "[1]", "#5", '"1"', "\u0661", "1\r", "1;2", "NA",
]  # fmt: skip

numbers = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.floats(-1e6, 1e6).map("{:.8g}".format),
    st.floats(-1e6, 1e6).map("{:+.6e}".format),
    st.floats(-1e6, 1e6).map("{:.17g}".format),
    st.integers().map(str),
)
fields = st.one_of(numbers, numbers, st.sampled_from(TRICKY))
line_ends = st.sampled_from(["\n", "\r\n"])


@st.composite
def texts(draw: st.DrawFn) -> bytes:
    """A CSV file whose time is sound and whose other fields are anything."""
    header = draw(st.sampled_from(["t,q1,tau1", "t,q1,tau1,note", "tau1,t,q1", "t,note,q1,tau1"]))
    width = header.count(",") + 1
    clean = draw(st.booleans())
    rows = []
    for k in range(draw(st.integers(10, 14))):
        row = [draw(numbers if clean else fields) for _ in range(width)]
        row[header.split(",").index("t")] = repr(k / 8)
        rows.append(",".join(row))
    return (header + "\n" + draw(line_ends).join(rows) + "\n").encode()


@given(texts())
def test_the_quick_way_agrees_with_the_strict_way(text):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.csv"
        path.write_bytes(text)
        quick = outcome(lambda: read_csv(path, Choice("file.csv")))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(csv_dialect, "parse_quickly", lambda *_: None)
            strict = outcome(lambda: read_csv(path, Choice("file.csv")))
    assert quick.message == strict.message
    assert (quick.rows is None) == (strict.rows is None)
    if quick.rows is not None:
        assert np.array_equal(quick.rows, strict.rows, equal_nan=True)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_every_float_survives_its_shortest_text(values):
    text = ",".join(map(repr, values)) + "\n"
    parsed = parse_quickly(text.encode(), b",", len(values), range(len(values)))
    assert parsed is not None
    assert np.array_equal(parsed, [values])


@pytest.mark.parametrize(
    ("text", "delimiter"),
    [
        (b"1,2,3\n4,5,6\n", b","),
        (b"1,2,3\r\n4,5,6\r\n", b","),
        (b"1;2;3\n4;5;6\n", b";"),
        (b"1\t2\t3\n4\t5\t6\n", b"\t"),
        (b" 1, 2, 3\n4,5 ,6\n", b","),
        (b"+1,2.,03\n4,5,6e0\n", b","),
    ],
)
def test_clean_text_takes_the_quick_way(text, delimiter):
    parsed = parse_quickly(text, delimiter, 3, (0, 1, 2))
    assert parsed is not None
    assert parsed.tolist() == [[1, 2, 3], [4, 5, 6]]


def test_missed_samples_take_the_quick_way():
    parsed = parse_quickly(b"1,,3\nnan,5,NaN\n", b",", 3, (0, 1, 2))
    assert np.array_equal(np.array(parsed), [[1, np.nan, 3], [np.nan, 5, np.nan]], equal_nan=True)


def test_text_columns_that_nobody_reads_take_the_quick_way():
    parsed = parse_quickly(b"a b,1,2,x\n/c/,3,4,y\n", b",", 4, (2, 1))
    assert parsed is not None
    assert parsed.tolist() == [[2, 1], [4, 3]]


@pytest.mark.parametrize(
    "text",
    [b"1,2\n3,4,5\n", b"1,2,3\n\n", b"# c,,\n1,2,3\n", b"1,2,3,4\n5,6\n", b"1,2,x\n", b"1,2,inf\n", b"1,2,3\0\n"],
)
def test_unusual_text_is_declined(text):
    assert parse_quickly(text, b",", 3, (0, 1, 2)) is None
