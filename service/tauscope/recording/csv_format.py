"""Recordings as CSV: a header line, `#` comment lines anywhere, one line a sample."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from tauscope.errors import RecordingError
from tauscope.number_text import counted
from tauscope.recording import csv_dialect
from tauscope.recording.columns import ColumnLayout, require_joint_count
from tauscope.recording.intake import Choice, RowIntake, SplitClock
from tauscope.recording.mapping import find_layout, order_by_cells
from tauscope.recording.recording import Array, Recording
from tauscope.recording.unit_text import collect_units, find_unit, root_of
from tauscope.recording.units import SI, Reading
from tauscope.robot.recording_layout import UNITS

_CHUNK_BYTES = 2**18
_LONGEST_LINE_BYTES = 2**20
_ROWS_WRITTEN_AT_ONCE = 8192
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_SAMPLE_BYTES = 2**16
_REMARKS = b"Comment"  # last column of LabVIEW's files, which rows without a remark lack


def read_csv(path: Path, choice: Choice) -> Recording:
    """Read a CSV in time linear and in memory bounded in its lines; an empty field or ``nan`` is a missed sample.

    Raises RecordingError, which names line and column, and RecordingMismatchError for another number of joints.
    """
    name = choice.file
    with path.open("rb") as file:
        header = _read_header(file, name, choice.reading)
        choice, layout = replace(choice, reading=header.reading), header.layout
        require_joint_count(layout.joint_count, choice.joint_count, name)
        intake: RowIntake | None = None
        for chunk in _chunks(file, header.line + 1, name):
            block, lines = _parse_chunk(chunk, header, name, is_first=intake is None or not len(intake))
            if layout.counts_rows:
                block[:, 0] = np.arange(len(block)) + (0 if intake is None else len(intake))
            if intake is None:
                expected = int(len(block) * os.fstat(file.fileno()).st_size / len(chunk.text) * 1.01) + 16
                intake = RowIntake(choice, layout.names, layout.effort_kind, expected)
            intake.add(block, lambda row, lines=lines: f"line {lines[row]}")
    intake = intake or RowIntake(choice, layout.names, layout.effort_kind)
    return intake.finish(layout.joint_count, layout.ignored, layout.notes)


def read_csv_header(path: Path, name: str) -> list[str]:
    """Names of a file's columns, or numbers from 1. Raises RecordingError where it holds no line of text."""
    with path.open("rb") as file:
        return _read_names(file, name, SI).names


def write_csv(recording: Recording, file: BinaryIO) -> None:
    """Write a recording as CSV; every number in the fewest digits that read back as the same float64."""
    table = recording.table
    file.write((",".join(table.names) + "\n").encode())
    for start in range(0, len(table), _ROWS_WRITTEN_AT_ONCE):
        block = table.rows(start, min(start + _ROWS_WRITTEN_AT_ONCE, len(table)))
        lines = [",".join(map(repr, row)) for row in block.tolist()]
        file.write(("\n".join(lines) + "\n").encode())


@dataclass(frozen=True)
class _Names:
    """The line before the first row, how fields are separated, and names of the columns."""

    line: int
    dialect: csv_dialect.Dialect
    names: list[str]


@dataclass(frozen=True)
class _Header:
    """The line before the first row, how fields are separated, and which column is which."""

    line: int
    dialect: csv_dialect.Dialect
    layout: ColumnLayout
    reading: Reading
    clock: csv_dialect.Clock
    split: SplitClock


@dataclass(frozen=True)
class _Chunk:
    """Whole lines of the file; `unterminated` where the file ends without a newline."""

    text: bytes
    first_line: int
    unterminated: bool


def _read_header(file: BinaryIO, name: str, reading: Reading) -> _Header:
    found = _read_names(file, name, reading)
    reading, layout = find_layout(found.names, reading, name)
    at, number, line = file.tell(), found.line, b"\n"
    while line and _is_empty(line):
        line, number = file.readline(_LONGEST_LINE_BYTES), number + 1
    units = _find_units(found.dialect.split(line.strip(b"\r\n")), layout)
    if units is None:
        file.seek(at)
        number = found.line
    else:  # stated units override it
        reading = replace(reading, units={**units, **reading.units})
        at = file.tell()
        line = file.readline(_LONGEST_LINE_BYTES)
        file.seek(at)
    cells = [_decode(cell) for cell in found.dialect.split(line.strip(b"\r\n"))]
    layout = order_by_cells(found.names, layout, cells, reading, name)
    return _Header(number, found.dialect, layout, reading, csv_dialect.Clock(), SplitClock())


def _find_units(cells: Sequence[bytes], layout: ColumnLayout) -> dict[str, str] | None:
    """Units of a row below the names, None where it holds anything but units."""
    if len(cells) != layout.width or any(map(csv_dialect.is_number, cells)):
        return None
    asked = {name: index for name, index in zip(layout.names, layout.source, strict=True) if root_of(name) in UNITS}
    texts = {name: _decode(cells[index]).strip(" []()") for name, index in asked.items()}
    units = collect_units(texts)
    is_known = all(find_unit(name, text) for name, text in texts.items())
    return units if is_known and all(unit in UNITS[root_of(name)] for name, unit in units.items()) else None


def _read_names(file: BinaryIO, name: str, reading: Reading) -> _Names:
    """Read up to the first line that is neither blank nor a comment; leave the file at the first row."""
    number, comment = 0, b""
    at = 0
    while line := file.readline(_LONGEST_LINE_BYTES):
        number += 1
        if number == 1:
            line = line.removeprefix(_BYTE_ORDER_MARK)
        if len(line) == _LONGEST_LINE_BYTES:
            raise _line_error(name, number)
        _require_text(line, number, name)
        if not _is_empty(line):
            return _parse_names(file, line.strip(b"\r\n"), number, at, comment, name, reading)
        comment = line.strip(b"\r\n\t #%") or comment
        at = file.tell()
    raise RecordingError(f"{name}: the file is empty; expected a header line with the columns t, q1…, tau1…")


def _parse_names(
    file: BinaryIO, line: bytes, number: int, at: int, comment: bytes, name: str, reading: Reading
) -> _Names:
    """Names of the columns: of the first line, of the comment before numbers, or numbers for want of names."""
    if b"\r" in line:
        raise RecordingError(f"{name}: the lines end with carriage returns alone; save the file with newlines")
    sign = None if reading.delimiter_sign is None else reading.delimiter_sign.encode()
    start = file.tell()
    raw = file.read(_SAMPLE_BYTES).split(b"\n")[:-1]
    sample = [line, *(each.strip(b"\r") for each in raw)]
    first, dialect = csv_dialect.find_first_row(sample, sign) or (
        1,
        csv_dialect.Dialect(sign or csv_dialect.find_delimiter(line)),
    )
    row = sample[first] if first < len(sample) else b""
    named = _find_header(sample[:first], row, dialect)
    if named is None and first:  # the lines differ: the first one says how they are meant
        dialect = csv_dialect.Dialect(sign or csv_dialect.find_delimiter(line))
    has_comma = dialect.shows_decimal_comma(sample[first:]) if reading.decimal is None else reading.decimal == ","
    rows = replace(dialect, has_decimal_comma=has_comma)
    if first == 0:
        fields = _name_numbers(comment, rows.split(line), dialect)
        start, number = at, number - 1
    else:
        index = named or 0
        fields = dialect.name_fields(sample[index], row)
        if index + 1 < first and (joined := _join_names(fields, dialect.name_fields(sample[index + 1], row))):
            fields, index = joined, index + 1
        start += sum(len(each) + 1 for each in raw[:index])
        number += index
        cells = rows.split(row)
        if len(cells) == len(fields) + 1 and not cells[-1]:  # a delimiter ends the rows, and not the header
            fields.append(b"")
        elif len(fields) == len(cells) + 1 and fields[-1] in (b"", _REMARKS):
            fields.pop()
    file.seek(start)
    return _Names(number, rows, [_decode(field) for field in fields])


def _find_header(lines: Sequence[bytes], row: bytes, dialect: csv_dialect.Dialect) -> int | None:
    """The first line with as many names as the row has fields; lines before it say something else."""
    cells = len(dialect.split(row))
    for index, line in enumerate(lines):
        names = [] if _is_empty(line) else dialect.name_fields(line, row)
        if len(names) - (names[-1:] == [_REMARKS]) == cells or len(names) == cells:
            return index
    return None


def _join_names(upper: Sequence[bytes], lower: Sequence[bytes]) -> list[bytes] | None:
    """Names of two lines, where only both together tell the columns apart: the joint above its quantities."""
    joined = [b" ".join(filter(None, names)) for names in zip(upper, lower, strict=False)]
    is_told = len(upper) == len(lower) and len(set(upper)) < len(upper) == len(set(joined))
    return joined if is_told else None


def _name_numbers(comment: bytes, row: Sequence[bytes], dialect: csv_dialect.Dialect) -> list[bytes]:
    """Names in the comment before a row, where it has as many; else numbers from 1."""
    for sign in (dialect, csv_dialect.Dialect(csv_dialect.BLANK)):
        if comment and len(names := sign.split(comment)) == len(row):
            return names
    return [b"%d" % column for column in range(1, len(row) + 1)]


def _decode(field: bytes) -> str:
    try:
        return field.decode("utf-8")
    except UnicodeDecodeError:
        return field.decode("cp1252", "replace")


def _chunks(file: BinaryIO, line: int, name: str) -> Iterator[_Chunk]:
    rest = b""
    while data := file.read(_CHUNK_BYTES):
        end = data.rfind(b"\n") + 1
        if end == 0:
            rest += data
            if len(rest) > _LONGEST_LINE_BYTES:
                raise _line_error(name, line)
            continue
        text = rest + data[:end]
        rest = data[end:]
        yield _Chunk(text, line, unterminated=False)
        line += int(np.count_nonzero(np.frombuffer(text, np.uint8) == ord("\n")))  # a fifth of the time of bytes.count
    if rest:
        yield _Chunk(rest + b"\n", line, unterminated=True)


def _parse_chunk(chunk: _Chunk, header: _Header, name: str, *, is_first: bool) -> tuple[Array, Sequence[int]]:
    layout = header.layout
    source = layout.source if layout.nanoseconds is None else (*layout.source, layout.nanoseconds)
    normal = header.dialect.normalize(chunk.text)
    block = csv_dialect.parse_quickly(normal, header.dialect.separator, layout.width, source)
    if block is not None:
        return _join_time(block, header), range(chunk.first_line, chunk.first_line + len(block))
    rows: list[list[float]] = []
    lines: list[int] = []
    text = normal[:-1].split(b"\n")
    for number, raw_line in enumerate(text, chunk.first_line):
        line = raw_line.rstrip(b"\r")  # two of them: text mode has translated a translated line end
        if _is_empty(line):
            continue
        is_truncated = chunk.unterminated and number == chunk.first_line + len(text) - 1
        fields = _split_line(line, number, header, name, is_truncated=is_truncated)
        if is_first and not rows:
            _refuse_units(fields, number, header, name)
        time, *others = zip((*layout.names, "t"), source, strict=False)
        row = [csv_dialect.parse_number(fields[index], name, number, column) for column, index in others]
        rows.append([header.clock.parse(fields[time[1]], name, number), *row])
        lines.append(number)
    return _join_time(np.array(rows, dtype=np.float64).reshape(len(rows), len(source)), header), lines


def _join_time(block: Array, header: _Header) -> Array:
    """Rows with one time, where seconds and nanoseconds have columns of their own."""
    if header.layout.nanoseconds is None:
        return block
    block[:, 0] = header.split.join(block[:, 0], block[:, -1])
    return block[:, :-1]


def _split_line(line: bytes, number: int, header: _Header, name: str, *, is_truncated: bool) -> list[bytes]:
    _require_text(line, number, name)
    fields = line.split(header.dialect.separator)
    width = header.layout.width
    if len(fields) == width:
        return fields
    if is_truncated and len(fields) < width:
        hint = ": the last line is truncated; delete it or copy the file again"
    elif header.dialect.delimiter == b"," and len(fields) > width and b";" in line:
        hint = "; separate all lines alike"
    elif header.dialect.delimiter == b"," and len(fields) >= 2 * width - 1 and all(map(csv_dialect.is_number, fields)):
        hint = ": are these decimal commas? write decimals with a point"
    else:
        hint = "; complete or delete the line"
    raise RecordingError(
        f"{name}: line {number} has {counted(len(fields), 'field')} where the header has {width} columns{hint}"
    )


def _refuse_units(fields: Sequence[bytes], number: int, header: _Header, name: str) -> None:
    """A first line without a single number is most likely a row of units."""
    wanted = [fields[index].strip(b' \t"') for index in header.layout.source]
    if any(wanted) and not any(csv_dialect.is_number(field) or field.lower() == b"nan" for field in wanted):
        text = csv_dialect.shown(b",".join(fields).strip())
        raise RecordingError(
            f"{name}: line {number} looks like a row of units ({text}), not all of which are known; delete it, and "
            "state those that are not SI by --units"
        )


def _line_error(name: str, number: int) -> RecordingError:
    return RecordingError(f"{name}: line {number} has more than {_LONGEST_LINE_BYTES} characters: is this a CSV file?")


def _require_text(line: bytes, number: int, name: str) -> None:
    if b"\0" in line:
        raise RecordingError(f"{name}: line {number} holds a NUL byte; the file is binary, damaged or not UTF-8 text")


def _is_empty(line: bytes) -> bool:
    return not line.strip() or csv_dialect.is_comment(line)
