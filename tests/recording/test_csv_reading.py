from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from recording.recording_files import csv_text, message_of, rows_of, snapshot
from tauscope.errors import RecordingMismatchError
from tauscope.recording import EffortKind, Reading, read_recording
from tauscope.recording.csv_format import read_csv
from tauscope.recording.intake import Choice
from tauscope.robot import JointType

LINES = csv_text().splitlines()
ROWS = np.array([[float(field) for field in line.split(",")] for line in LINES[1:]])


def read(folder: Path, content: str | bytes, joint_count: int | None = None):
    path = folder / "file.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    before = snapshot(folder)
    try:
        return read_recording(path, joint_count)
    finally:
        assert snapshot(folder) == before


def changed(line: int, text: str) -> str:
    """The sound file with one line, counted from 1, replaced."""
    return "\n".join([*LINES[: line - 1], text, *LINES[line:]]) + "\n"


def field_changed(line: int, column: str, text: str) -> str:
    fields = LINES[line - 1].split(",")
    fields[LINES[0].split(",").index(column)] = text
    return changed(line, ",".join(fields))


SAME = {
    "as it is": "\n".join(LINES) + "\n",
    "no newline at the end": "\n".join(LINES),
    "blank lines at the end": "\n".join(LINES) + "\n\n  \n",
    "carriage returns": "\r\n".join(LINES) + "\r\n",
    "line ends translated twice": "\r\r\n".join(LINES) + "\r\r\n",
    "byte order mark": "\ufeff" + "\n".join(LINES) + "\n",
    "comments everywhere": "# one\n\n#two, with, commas\n" + "\n# between\n".join(LINES) + "\n   # last\n",
    "semicolons": "\n".join(LINES).replace(",", ";") + "\n",
    "tabs": "\n".join(LINES).replace(",", "\t") + "\n",
    "blanks around fields": "\n".join(LINES).replace(",", " ,  ") + "\n",
    "quoted names": ",".join(f'"{name}"' for name in LINES[0].split(",")) + "\n" + "\n".join(LINES[1:]),
    "comma at each line's end": ",\n".join(LINES) + ",\n",
    "blanks as separators": "\n".join(LINES).replace(",", " ") + "\n",
    "runs of blanks": "\n".join("  " + line.replace(",", " \t ") for line in LINES) + "\n",
    "bars": "\n".join(LINES).replace(",", "|") + "\n",
    "decimal commas": "\n".join(LINES).replace(",", ";").replace(".", ",") + "\n",
    "decimal commas and blanks": "\n".join(LINES).replace(",", " ").replace(".", ",") + "\n",
    "names in a comment, as numpy.savetxt writes": "# " + "\n".join(LINES) + "\n",
    "a row of units": "\n".join([LINES[0], "s,rad,rad,Nm,Nm", *LINES[1:]]),
    "a row of units in brackets": "\n".join([LINES[0], "[s],[rad],(m),[Nm],[N·m]", *LINES[1:]]),
    "every field in quotes": "\n".join(",".join(f'"{field}"' for field in line.split(",")) for line in LINES) + "\n",
    "decimal commas in quotes": "\n".join(
        ",".join(f'"{field}"'.replace(".", ",") for field in line.split(",")) for line in LINES
    ),
    "lines before the header": "Robot: arm 7\r\nrate [Hz], 250\r\n\r\n" + "\r\n".join(LINES) + "\r\n",
    "words before semicolons": "Export, of today\n" + "\n".join(LINES).replace(",", ";") + "\n",
    "a name of another code page": ("\n".join(f"{line},{'°C' if line == LINES[0] else 1}" for line in LINES)).encode(
        "cp1252"
    ),
    "pandas index": "," + LINES[0] + "\n" + "\n".join(f"{k},{line}" for k, line in enumerate(LINES[1:])),
    "text in a column that nobody reads": "\n".join(line + (",state" if line == LINES[0] else ",go") for line in LINES),
    "text in a first column that nobody reads": "\n".join(
        ("x," if line == LINES[0] else '"go #1",') + line for line in LINES
    ),
    "a comment like a row before a column that nobody reads": "\n".join(
        ("x," if line == LINES[0] else "go,") + line + ("\n# no,9,9,9,9,9" if line == LINES[5] else "")
        for line in LINES
    ),
    "columns in another order": "\n".join(",".join(reversed(line.split(","))) for line in LINES),
}


@pytest.mark.parametrize("name", SAME)
def test_the_same_recording_written_differently(tmp_path, name):
    recording = read(tmp_path, SAME[name], 2)
    assert recording.table.names == ("t", "q1", "q2", "tau1", "tau2")
    assert np.array_equal(rows_of(recording), ROWS)
    assert recording.effort_kind is EffortKind.TORQUE


@pytest.mark.parametrize("text", ["", "nan", "NaN", "NAN", " nan ", "-nan", " "])
def test_missed_samples_are_nan(tmp_path, text):
    expected = ROWS.copy()
    expected[5, 2] = np.nan
    assert np.array_equal(rows_of(read(tmp_path, field_changed(7, "q2", text))), expected, equal_nan=True)


@pytest.mark.parametrize("text", ["1", "-0", "+1.5", ".5", "-5.", "1e5", "1E+05", "1e-400", "0" * 50 + "1", "9" * 40])
def test_decimal_numbers_of_any_shape(tmp_path, text):
    assert rows_of(read(tmp_path, field_changed(9, "tau1", text)))[7, 3] == float(text)


def test_current_and_optional_columns(tmp_path):
    header = "temp2,i1,i2,t,q2,q1,period,qref1,qref2,note"
    body = "\n".join(f"30,{k},{-k},{k / 10},2,1,{k // 10},{k},{k},fine" for k in range(30))
    recording = read(tmp_path, f"{header}\n{body}\n", 2)
    assert recording.effort_kind is EffortKind.CURRENT
    assert recording.table.names == ("t", "q1", "q2", "i1", "i2", "qref1", "qref2", "temp2", "period")
    assert recording.ignored_columns == ("note",)
    samples = recording.samples(10, 12)
    assert samples.position.tolist() == [[1, 2], [1, 2]]
    assert samples.effort.tolist() == [[10, -10], [11, -11]]
    assert samples.reference is not None
    assert samples.reference.tolist() == [[10, 10], [11, 11]]
    assert samples.temperature is not None
    assert np.array_equal(samples.temperature, [[np.nan, 30], [np.nan, 30]], equal_nan=True)
    assert samples.period is not None
    assert samples.period.tolist() == [1, 1]
    assert samples.velocity is None
    assert samples.link_position is None


def test_torque_is_preferred_to_current_and_the_current_is_remembered(tmp_path):
    text = "\n".join(line + (",i1,i2" if line == LINES[0] else ",7,8") for line in LINES)
    recording = read(tmp_path, text)
    assert recording.effort_kind is EffortKind.TORQUE
    assert np.array_equal(rows_of(recording), ROWS)
    assert recording.ignored_columns == ("i1", "i2")


HEADER_ONLY = LINES[0] + "\n"
BAD = {
    "empty": ("", "file is empty"),
    "comments only": ("# nothing\n\n", "file is empty"),
    "header only": (HEADER_ONLY, "holds no sample"),
    "one row": ("\n".join(LINES[:2]), "holds only 1 sample"),
    "nine rows": ("\n".join(LINES[:10]), "holds only 9 samples"),
    "no header": ("\n".join(LINES[1:]), "the first row holds numbers where the column names are expected"),
    "units row": (changed(1, LINES[0] + "\ns,rad,rad,lb,lb"), "line 2 looks like a row of units ('s,rad,rad,lb,lb')"),
    "torques in two units": (changed(1, LINES[0] + "\ns,rad,rad,Nm,mA"), "line 2 looks like a row of units"),
    "no time": (changed(1, "time,q1,q2,tau1,tau2"), "column t (time in seconds) is missing; the columns are time, q1"),
    "no position": (changed(1, "t,p1,p2,tau1,tau2"), "column q1 (position of joint 1) is missing"),
    "no effort": (changed(1, "t,q1,q2,a,b"), "column tau1 (or i1, torque or current of joint 1) is missing"),
    "gap in q": (changed(1, "t,q1,q3,tau1,tau2"), "column q2 is missing: the file has columns up to q3"),
    "more q than tau": (changed(1, "t,q1,q2,tau1,q3"), "column tau2 is missing: the file has columns up to q3"),
    "more tau than q": (changed(1, "t,q1,tau1,tau2,x"), "column q2 is missing: the file has columns up to tau2"),
    "joint zero": (changed(1, "t,q0,q1,tau0,tau1"), "column q0 belongs to no joint: joints are numbered from 1"),
    "twice": (changed(1, "t,q1,q1,tau1,tau2"), "column q1 appears twice (as columns 2 and 3)"),
    "foreign joint": (changed(1, "t,q1,qd2,tau1,x"), "column qd2 belongs to no joint: the positions are q1 to q1"),
    "header again": (
        changed(17, LINES[0]),
        "line 17, column q1: 'q1' is not a number; is this the header again? split",
    ),
    "text": (field_changed(17, "tau2", "abc"), "line 17, column tau2: 'abc' is not a number"),
    "hexadecimal": (field_changed(17, "tau2", "0x1A"), "line 17, column tau2: '0x1A' is not a number"),
    "underscore": (field_changed(17, "tau2", "1_000"), "line 17, column tau2: '1_000' is not a number"),
    "two numbers": (field_changed(17, "tau2", "1 2"), "line 17, column tau2: '1 2' is not a number"),
    "nan with payload": (field_changed(17, "tau2", "nan(1)"), "line 17, column tau2: 'nan(1)' is not a number"),
    "other digits": (field_changed(17, "tau2", "\u0661"), "line 17, column tau2: '\u0661' is not a number"),
    "json": (field_changed(17, "q1", "true"), "line 17, column q1: 'true' is not a number"),
    "infinite": (field_changed(17, "q1", "inf"), "line 17, column q1: 'inf' is not a number; leave the field empty"),
    "Infinity": (field_changed(17, "q1", "-Infinity"), "line 17, column q1: '-Infinity' is not a number"),
    "overflow": (field_changed(17, "q1", "1e400"), "line 17, column q1: '1e400' is too large for a number"),
    "long overflow": (field_changed(17, "q1", "9" * 400), "is too large for a number"),
    "control character": (field_changed(17, "q1", "\x1b[2J"), "line 17, column q1: '\\x1b[2J' is not a number"),
    "lone carriage return": (field_changed(17, "q1", "1\r2"), "line 17, column q1: '1\\r2' is not a number"),
    "time missing": (field_changed(17, "t", ""), "line 17, column t: the time is missing"),
    "time infinite": (field_changed(17, "t", "inf"), "line 17, column t: 'inf' is not a number"),
    "time repeats": ("t,q1,tau1\n" + "".join(f"{k // 2},0,0\n" for k in range(40)), "20 of 40 rows repeat the time"),
    "time decreases": (field_changed(17, "t", "0.01"), "line 17, column t: time runs backwards: 0.01 s after 0.056 s"),
    "date": (field_changed(2, "t", "2024-15-01 10:00"), "line 2, column t: '2024-15-01 10:00' is no date of ISO 8601"),
    "few fields": (changed(17, "0.06,1,2"), "line 17 has 3 fields where the header has 5 columns"),
    "many fields": (changed(17, "0.06,1,2,3,4,5"), "line 17 has 6 fields where the header has 5 columns"),
    "decimal commas": (changed(17, "0,06,1,5,2,5,3,5,4,5"), "decimal commas? write decimals with a point"),
    "decimal comma": ("\n".join(LINES).replace(",", ";").replace(".", ",", 1), "'0,0' is not a number; write decimals"),
    "truncated": (
        "\n".join([*LINES, "0.16,1,2"]),
        "line 42 has 3 fields where the header has 5 columns: the last line is",
    ),
    "NUL": (field_changed(17, "q1", "1\0"), "line 17 holds a NUL byte"),
    "NUL in the header": (changed(1, "t\0" + LINES[0]), "line 1 holds a NUL byte"),
    "echo of a topic": ("header:\n  stamp:\n", "is text of `ros2 topic echo`; record a bag, or echo with --csv"),
    "UTF-16": ("\n".join(LINES).encode("utf-16"), "is UTF-16 text; save it as UTF-8"),
    "long line": (changed(17, "1," + "2" * 2**21), "line 17 has"),
    "long header": ("t" * 2**21, "line 1 has more than 1048576 characters"),
    "damaged gzip": (b"\x1f\x8b\x08\0\0\0", "cannot be decompressed"),
    "spreadsheet": (b"PK\x03\x04\x14\0", "is a zip archive or a spreadsheet"),
    "period": ("t,q1,tau1,period\n" + "\n".join(f"{k},0,0,{k / 4}" for k in range(20)), "line 3, column period: 0.25"),
    "old line ends": ("\r".join(LINES), "the lines end with carriage returns alone"),
}


@pytest.mark.parametrize(
    "text",
    ["", "nan", "-nan", "NA", "N/A", "#N/A", "#NV", "null", "None", "<NA>", "-", "-nan(ind)", "1.#QNAN", "-1.#IND"],
)
def test_what_programs_write_for_no_number_is_a_missed_sample(tmp_path: Path, text: str) -> None:
    rows = rows_of(read(tmp_path, field_changed(17, "tau2", text)))
    assert np.argwhere(np.isnan(rows)).tolist() == [[15, 4]]


@pytest.mark.parametrize(
    "stamp",
    [
        lambda second: f"30.11.2026 23:59:{second:09.6f}",
        lambda second: f"2026-11-30T23:59:{second:09.6f}Z",
        lambda second: f"23:59:{second:09.6f}",
        lambda second: f"2 days 23:59:{second:09.6f}",
        lambda second: f"{second:.6f} sec",
    ],
    ids=["German", "ISO", "time of day", "pandas duration", "MATLAB duration"],
)
def test_times_of_other_programs_are_seconds(tmp_path: Path, stamp: Callable[[float], str]) -> None:
    times = (stamp(row[0]) for row in ROWS)
    lines = [",".join([time, *line.split(",")[1:]]) for time, line in zip(times, LINES[1:], strict=True)]
    rows = rows_of(read(tmp_path, "\n".join([LINES[0], *lines])))
    np.testing.assert_allclose(rows[:, 0] - rows[0, 0], ROWS[:, 0], atol=2e-6)
    np.testing.assert_array_equal(rows[:, 1:], ROWS[:, 1:])


def test_times_of_day_go_on_after_midnight(tmp_path: Path) -> None:
    times = [
        f"{'23:59:59' if time < 0.08 else '00:00:00'}.{round(1e3 * (time + 0.92) % 1e3):03d}" for time in ROWS[:, 0]
    ]
    lines = [",".join([time, *line.split(",")[1:]]) for time, line in zip(times, LINES[1:], strict=True)]
    rows = rows_of(read(tmp_path, "\n".join([LINES[0], *lines])))
    np.testing.assert_allclose(rows[:, 0], ROWS[:, 0], atol=1e-9)


def test_a_german_table_keeps_its_semicolons_beside_commas_in_dates(tmp_path: Path) -> None:
    lines = [
        ";".join([f"30.11.2026 23:59:{row[0]:06.3f}", *map(repr, row[1:])]).replace(".", ",").replace(",11,", ".11.")
        for row in ROWS.tolist()
    ]
    rows = rows_of(read(tmp_path, "\n".join([LINES[0].replace(",", ";"), *lines])))
    np.testing.assert_allclose(rows[:, 0], ROWS[:, 0], atol=1e-9)
    np.testing.assert_array_equal(rows[:, 1:], ROWS[:, 1:])


@pytest.mark.parametrize(("group", "point"), [(".", ","), (",", ".")], ids=["German", "English"])
def test_signs_between_thousands_are_no_decimals(tmp_path: Path, group: str, point: str) -> None:
    def written(value: float) -> str:
        whole, _, decimals = f"{value:,.3f}".partition(".")
        return whole.replace(",", group) + point + decimals

    rows = np.round(ROWS * [1.0, 1.0, 1.0, 1e5, 1e5], 3)
    lines = [";".join([repr(time).replace(".", point), *map(written, others)]) for time, *others in rows.tolist()]
    found = rows_of(read(tmp_path, "\n".join([LINES[0].replace(",", ";"), *lines])))
    np.testing.assert_allclose(found, rows, rtol=1e-12)
    quoted = [",".join(f'"{field}"' for field in line.split(";")) for line in lines]
    np.testing.assert_allclose(rows_of(read(tmp_path, "\n".join([LINES[0], *quoted]))), rows, rtol=1e-12)


def test_whole_thousands_beside_decimal_commas_are_whole(tmp_path: Path) -> None:
    lines = [f"{row[0]!r};0,5;0,5;#;2".replace(".", ",").replace("#", "1.243") for row in ROWS.tolist()]
    found = rows_of(read(tmp_path, "\n".join([LINES[0].replace(",", ";"), *lines])))
    assert set(found[:, 3]) == {1243.0}


def test_a_point_behind_a_zero_is_no_sign_between_thousands(tmp_path: Path) -> None:
    lines = [f"{row[0]!r};0,5;0,5;#;2".replace(".", ",").replace("#", "0.697") for row in ROWS.tolist()]
    message = message_of(lambda: read(tmp_path, "\n".join([LINES[0].replace(",", ";"), *lines])))
    assert "is not a number; write decimals with a point" in message


def test_a_column_that_nobody_reads_may_have_any_name_twice(tmp_path: Path) -> None:
    lines = [LINES[0] + ",note,note", *(line + ",1,2" for line in LINES[1:])]
    np.testing.assert_array_equal(rows_of(read(tmp_path, "\n".join(lines))), ROWS)


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_with_the_place(tmp_path, name):
    content, expected = BAD[name]
    message = message_of(lambda: read(tmp_path, content))
    assert message.startswith(f"{tmp_path / 'file.csv'}: ")
    assert expected in message


def test_line_numbers_count_comments_and_blank_lines(tmp_path):
    text = "# head\n\n" + field_changed(17, "q1", "abc").replace("\n", "\n# again\n")
    assert f"line {2 + 17 * 2 - 1}, column q1" in message_of(lambda: read(tmp_path, text))


def test_line_numbers_far_into_the_file(tmp_path):
    lines = csv_text(20_000).splitlines()
    lines[15_000] = lines[15_000].replace(",", ",x", 1)
    assert "line 15001, column q1: 'x" in message_of(lambda: read(tmp_path, "\n".join(lines)))
    lines = csv_text(20_000).splitlines()
    lines[15_000] = "# comment"
    lines[15_001] = lines[14_900]
    assert "line 15002, column t: time runs backwards" in message_of(lambda: read(tmp_path, "\n".join(lines)))


def test_a_repeated_and_a_late_row_are_put_right(tmp_path):
    sound = read(tmp_path, csv_text(20_000))
    lines = csv_text(20_000).splitlines()
    lines[15_000], lines[15_003] = lines[15_003], lines[15_000]
    lines.insert(17, lines[16])
    recording = read(tmp_path, "\n".join(lines))
    assert np.array_equal(rows_of(recording), rows_of(sound))
    assert [warning.code for warning in recording.warnings] == ["time-stamps", "time-stamps"]
    late, repeated = (warning.text for warning in recording.warnings)
    assert "column t: 2 rows came after a later one" in late
    assert "column t: 1 row has the time of the row before, first at t = 0.06 s; left out" in repeated


@pytest.mark.parametrize("date", ["2026-11-28T", "2026-11-28 ", ""])
def test_dates_become_seconds_from_the_first_row(tmp_path, date):
    rows = (f"{date}23:59:{59 + k // 10 if k < 10 else k // 10 - 1:02d}.{k % 10}00Z,{k},0" for k in range(10))
    recording = read(tmp_path, "\n".join(["t,q1,tau1", *rows]))
    np.testing.assert_allclose(recording.samples().time, np.arange(10) / 10, atol=1e-9)


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
def test_time_in_other_units_counts_from_the_first_row(tmp_path, unit):
    ticks = {"ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    rows = (f"{1_700_000_000 * ticks + k * ticks // 100},{k},0" for k in range(20))
    path = tmp_path / "file.csv"
    path.write_text("\n".join(["t,q1,tau1", *rows]))
    recording = read_recording(path, reading=Reading({"t": unit}))
    np.testing.assert_allclose(recording.samples().time, np.arange(20) / 100, atol=1e-6)


def test_degrees_and_currents_are_converted(tmp_path):
    path = tmp_path / "file.csv"
    path.write_text("t,q1,q2,tau1,tau2,qd1,qd2\n" + "".join(f"{k},180,{k},1000,{k},90,90\n" for k in range(20)))
    types = (JointType.REVOLUTE, JointType.PRISMATIC)
    units = {"q": "deg", "q2": "mm", "tau": "mA", "t": "index"}
    recording = read_recording(path, reading=Reading(units, 50.0, joint_types=types))
    samples = recording.samples()
    assert recording.effort_kind is EffortKind.CURRENT
    assert recording.table.names[3:5] == ("i1", "i2")
    assert samples.time[-1] == pytest.approx(19 / 50)
    assert samples.velocity is not None
    np.testing.assert_allclose(samples.position[:, 0], np.pi)
    np.testing.assert_allclose(samples.position[:, 1], np.arange(20) * 1e-3)
    np.testing.assert_allclose(samples.velocity[0], [np.pi / 2, 0.09])
    np.testing.assert_allclose(samples.effort[:, 0], 1.0)


@pytest.mark.parametrize(
    ("joints", "robot", "expected"),
    [
        (2, 3, "the recording has 2 joints, the robot has 3 joints: column q3 is missing"),
        (3, 1, "the recording has 3 joints, the robot has 1 joint: column q2 belongs to no joint"),
    ],
)
def test_another_robots_recording(tmp_path, joints, robot, expected):
    with pytest.raises(RecordingMismatchError, match=expected):
        read(tmp_path, csv_text(joints=joints), robot)


def test_absent_and_unreadable_files(tmp_path):
    assert "nothing.csv: no such file" in message_of(lambda: read_recording(tmp_path / "nothing.csv"))
    assert "a folder without metadata.yaml" in message_of(lambda: read_recording(tmp_path))
    assert "not a regular file" in message_of(lambda: read_recording("/dev/zero"))
    assert "no such file" in message_of(lambda: read_recording(tmp_path / "file.csv" / "below"))


def test_spooled_reading_gives_the_same_rows(tmp_path):
    path = tmp_path / "long.csv"
    path.write_text(csv_text(30_000))
    kept = read_csv(path, Choice("long"))
    for limit in (1000, 400_000):
        spooled = read_csv(path, Choice("long", spool_above_bytes=limit))
        assert type(spooled.table) is not type(kept.table)
        assert np.array_equal(rows_of(spooled), rows_of(kept))
        assert np.array_equal(spooled.samples(777, 29_001).effort, kept.samples(777, 29_001).effort)
    assert [file.name for file in tmp_path.iterdir()] == ["long.csv"]


def test_a_row_that_comes_nine_rows_early_is_refused_wherever_blocks_end(tmp_path):
    lines = [*LINES[:6], field_changed(7, "t", "1").splitlines()[6], *LINES[7:16]]
    assert "column t: time runs backwards" in message_of(lambda: read(tmp_path, "\n".join(lines)))
    assert "column t: time runs backwards" in message_of(lambda: read(tmp_path, "\n".join(lines) + "\n"))
    assert len(read(tmp_path, "\n".join(lines[:-1]) + "\n")) == 14


HEADS = {
    "counts of channels and samples": "Samples;40;40\nChannels;4;4\n",
    "lines of two words": "Robot;RR\nVersion;1;2\n\n",
}


@pytest.mark.parametrize("name", HEADS)
def test_lines_before_the_names_may_hold_numbers(tmp_path: Path, name: str) -> None:
    assert np.array_equal(rows_of(read(tmp_path, HEADS[name] + csv_text().replace(",", ";"))), ROWS)


def test_a_file_of_labview(tmp_path: Path) -> None:
    head = "LabVIEW Measurement\t\nDecimal_Separator\t.\n***End_of_Header***\t\n\nSamples\t40\t40\nX0\t0.0\t0.0\n"
    text = csv_text().replace(",", "\t").replace("tau2", "tau2\tComment", 1)
    assert np.array_equal(rows_of(read(tmp_path, head + text)), ROWS)


def test_a_header_of_matlab(tmp_path: Path) -> None:
    assert np.array_equal(rows_of(read(tmp_path, "% " + csv_text().replace(",", " "))), ROWS)


def test_dates_with_slashes(tmp_path: Path) -> None:
    dates = [f"2026/03/01/10:00:{row[0]:09.6f}" for row in ROWS]
    lines = [LINES[0], *(date + line[line.index(",") :] for date, line in zip(dates, LINES[1:], strict=True))]
    assert np.allclose(rows_of(read(tmp_path, "\n".join(lines) + "\n")), ROWS)


@pytest.mark.parametrize("separator", [" ", ", ", "; "])
def test_lists_in_cells(tmp_path: Path, separator: str) -> None:
    cells = [
        [repr(row[0]), *(f'"[{separator.join(map(repr, row[k : k + 2]))}]"' for k in (1, 3))] for row in ROWS.tolist()
    ]
    (tmp_path / "file.csv").write_text("\n".join(["t,q,tau", *map(",".join, cells)]) + "\n", encoding="utf-8")
    reading = Reading(columns={"t": "t", "q": "q", "tau": "tau"})
    assert np.array_equal(rows_of(read_recording(tmp_path / "file.csv", reading=reading)), ROWS)
    bare = [line.replace("[", "").replace("]", "") for line in map(",".join, cells)]
    (tmp_path / "file.csv").write_text("\n".join(["t,q,tau", *bare]) + "\n", encoding="utf-8")
    if separator == " ":
        assert np.array_equal(rows_of(read_recording(tmp_path / "file.csv", reading=reading)), ROWS)
