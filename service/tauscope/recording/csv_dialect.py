"""Text of a CSV file: its signs, quotes and lists; its numbers, in a quick way for clean text and a strict one.

The quick way hands a whole block of text to the JSON parser of pydantic-core: 10,000 rows of 13 columns in 7 ms, where
numpy.loadtxt takes 7 (8 digits) to 21 ms (17 digits). A JSON number is a decimal number as the strict way knows it,
and both round correctly, so they agree on every text that both take; what the quick way declines, the strict one gets.
"""

import csv
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

import numpy as np
from pydantic_core import from_json

from tauscope.errors import RecordingError
from tauscope.recording.layout.families import is_name_list
from tauscope.recording.samples import Array

_NUMBER_BYTES = b"0123456789+-.eE \tnaN"
_NOT_SEPARATORS = bytes(set(range(256)) - set(b",\n"))
_NUMBER = re.compile(rb"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
# What programs write where a sample was missed: pandas, R, Excel (German, too) and the C library of Windows.
_MISSED = re.compile(rb"[+-]?(?:nan(?:\(ind\))?|1\.#(?:IND|QNAN))|-|#?n/?a|#nv|<na>|null|none", re.IGNORECASE)
_DATE = re.compile(rb"[0-9]{4}-[0-9]{2}-[0-9]{2}[T ]|[0-9]{2}:[0-9]{2}:")
_GERMAN_DATE = re.compile(rb"([0-9]{2})\.([0-9]{2})\.([0-9]{4})[T ]+([0-9]{2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?)")
# Dates in other orders and signs, and how they are written by ISO 8601.
_DATES = {_GERMAN_DATE: rb"\3-\2-\1T\4", re.compile(rb"([0-9]{4})/([0-9]{2})/([0-9]{2})[/ T]"): rb"\1-\2-\3T"}
_DURATION = re.compile(rb"([0-9]+) days? ([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]+)?)")  # as pandas writes it
_SHOWN_CHARACTERS = 40
_ROWS_SEEN = 20  # lines of numbers by which their usual width is told


def parse_quickly(text: bytes, delimiter: bytes, width: int, source: Sequence[int]) -> Array | None:
    """Parse a block of complete lines to (rows, len(source)); None where a line holds anything but `width` numbers."""
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n")
    if delimiter != b",":
        if b"," in text:
            return None
        text = text.replace(delimiter, b",")
    separators = text.translate(None, _NUMBER_BYTES)
    lines = len(separators) // width
    if separators == (b"," * (width - 1) + b"\n") * lines:
        values = _parse_numbers(text[:-1].replace(b"\n", b","))
        if values is None:
            return None
        table = values.reshape(lines, width)
        return table if tuple(source) == tuple(range(width)) else table[:, list(source)]  # all in order: no copy
    if len(source) == width or b"#" in text or b"\0" in text:
        return None
    # Columns that nobody reads may hold any text: set them aside and try again.
    lines = text.count(b"\n")
    if text.translate(None, _NOT_SEPARATORS) != (b"," * (width - 1) + b"\n") * lines:
        return None
    fields = text[:-1].replace(b"\n", b",").split(b",")
    wanted = b",".join(b",".join(fields[index::width]) for index in source)
    if wanted.translate(None, _NUMBER_BYTES + b","):
        return None
    values = _parse_numbers(wanted)
    return None if values is None else np.ascontiguousarray(values.reshape(len(source), lines).T)


def _parse_numbers(text: bytes) -> Array | None:
    """Fields of number characters, separated by commas; None where one is no number, or is too large for float64."""
    try:
        try:
            json = text.replace(b"nan", b"NaN") if b"n" in text else text
            numbers = from_json(b"[" + json + b"]")
            values = np.frombuffer(struct.pack(f"{len(numbers)}d", *numbers))  # half the time of np.array
        except (ValueError, struct.error):  # a plus sign, a bare point or an empty field is no JSON
            values = np.array([float(field) if field else np.nan for field in text.split(b",")])
    except (ValueError, OverflowError):
        return None
    return None if np.isinf(values).any() else values


def parse_number(field: bytes, file: str, line: int, column: str) -> float:
    """A decimal number, NaN where the field says that there is none. Raises RecordingError for anything else."""
    text = field.strip(b" \t")
    if not text or _MISSED.fullmatch(text):
        return np.nan
    if not is_number(text):
        again = "; is this the header again? split the file there" if text == column.encode() else _hint(text)
        raise RecordingError(f"{file}: line {line}, column {column}: {shown(text)} is not a number{again}")
    value = float(text)
    if np.isinf(value):
        raise RecordingError(f"{file}: line {line}, column {column}: {shown(text)} is too large for a number")
    return value


class Clock:
    """Reads a file's column t: numbers, durations, or dates or times of day, as seconds since the first."""

    def __init__(self) -> None:
        self._first: datetime | None = None
        self._last: datetime | None = None
        self._midnights = timedelta()

    def parse(self, field: bytes, file: str, line: int) -> float:
        """Time of a row, in the file's own unit. Raises RecordingError where it is neither a number nor a date."""
        text = field.strip(b' \t"')
        if duration := _DURATION.fullmatch(text):
            days, hours, minutes, seconds = (float(part or 0) for part in duration.groups())
            return ((24.0 * days + hours) * 60.0 + minutes) * 60.0 + seconds
        for date, iso in _DATES.items():
            text = date.sub(iso, text)
        if not _DATE.match(text):
            return parse_number(text.removesuffix(b" sec"), file, line, "t")
        try:
            has_day = b"-" in text[:5]
            stamp = datetime.fromisoformat(("" if has_day else "2000-01-01T") + text.decode("ascii"))
            if not has_day and self._last is not None and stamp < self._last - timedelta(hours=12):
                self._midnights += timedelta(days=1)
            self._first, self._last = self._first or stamp, stamp
            return (stamp + self._midnights - self._first).total_seconds()
        except (ValueError, TypeError) as error:
            reason = "has a time zone in some rows only" if isinstance(error, TypeError) else "is no date of ISO 8601"
            raise RecordingError(f"{file}: line {line}, column t: {shown(text)} {reason}") from error


def is_number(field: bytes) -> bool:
    """Whether a field is a decimal number."""
    return _NUMBER.fullmatch(field.strip(b" \t")) is not None


def shown(text: bytes) -> str:
    """A piece of a file, safe to show on one line of a message."""
    words = text.decode("utf-8", "replace")
    return repr(words if len(words) <= _SHOWN_CHARACTERS else words[:_SHOWN_CHARACTERS] + "…")


def _hint(text: bytes) -> str:
    """What to do about text that looks like a known mistake."""
    lower = text.lower().lstrip(b"+-")
    if lower in (b"inf", b"infinity"):
        return "; leave the field empty where a sample was missed"
    if text.count(b":") == 2:
        return "; write a date as 2026-01-31T12:34:56.789"
    if re.fullmatch(rb"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?", text):
        return "; write decimals with a point"
    return ""


BLANK = b" "

_SHOWN_BY = (b";", b"\t", b"|")
_DECIMAL_COMMA = re.compile(rb"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
# Whole fields with signs between thousands, by whether decimals stand behind a comma.
_THOUSANDS = {
    True: re.compile(rb"(?<![^;\t| \n])[+-]?[1-9][0-9]{0,2}(?:\.[0-9]{3})+(?=,[0-9]|[;\t| \r\n]|\Z)"),
    False: re.compile(rb"(?<![^;\t| \n])[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+(?=\.[0-9])"),
}


@dataclass(frozen=True)
class Dialect:
    """Signs of a text file; quotes and brackets hold fields together: ``"1.5"``, ``"[0.1, 0.2]"``."""

    delimiter: bytes
    has_decimal_comma: bool = False

    @property
    def separator(self) -> bytes:
        """Delimiter of normal text."""
        return b"," if self.delimiter == BLANK else self.delimiter

    def normalize(self, text: bytes) -> bytes:
        """Whole lines, written with decimal points, without runs of blanks, quotes and brackets."""
        if _has_cells(text):
            return b"\n".join(map(self._open_cells, text.split(b"\n")))
        if self.delimiter != b",":
            text = _THOUSANDS[self.has_decimal_comma].sub(_join_thousands, text)
        if self.has_decimal_comma:
            text = text.replace(b",", b".")
        if self.delimiter != BLANK:
            return text
        return b"\n".join(b",".join(line.split()) for line in text.split(b"\n"))

    def split(self, line: bytes) -> list[bytes]:
        """Fields of a line, without blanks and quotes around them."""
        return [field.strip(b' \t\r"') for field in self.normalize(line).split(self.separator)]

    def name_fields(self, header: bytes, row: bytes) -> list[bytes]:
        """Names of a row's fields: a name whose cell is a list stands for its elements, by joint or numbered from 0."""
        names, cells = self._cells(header), self._cells(row)
        if len(names) != len(cells):
            return [name.strip().encode("latin-1") for name in names]
        lists = [_TEXT.findall(cell) for name, cell in zip(names, cells, strict=True) if is_name_list(name.strip())]
        found = []
        for name, cell in zip(names, cells, strict=True):
            text, count = name.strip(), len(_elements(cell))
            elements = next((joints for joints in lists if len(set(joints)) == count), range(count))
            found += [f"{text}[{element}]" for element in elements] if _is_list(cell) else [text]
        return [name.encode("latin-1") for name in found]

    def shows_decimal_comma(self, lines: Sequence[bytes]) -> bool:
        """Whether lines of numbers write decimals with a comma: some do, and none has a point."""
        if any(map(_has_cells, lines)):
            fields = [cell.encode("latin-1") for line in lines for cell in self._cells(line)]
        elif self.delimiter == b",":
            return False
        else:
            fields = [
                f for line in lines for f in (line.split() if self.delimiter == BLANK else line.split(self.delimiter))
            ]
        commas = any(_DECIMAL_COMMA.fullmatch(field.strip()) for field in fields)
        points = (field for field in fields if is_number(field) and b"." in field)
        return commas and all(_THOUSANDS[True].fullmatch(field.strip()) for field in points)

    def _open_cells(self, line: bytes) -> bytes:
        if is_comment(line):
            return line
        fields = [field.encode("latin-1") for cell in self._cells(line.rstrip(b"\r")) for field in _elements(cell)]
        fields = [_THOUSANDS[self.has_decimal_comma].sub(_join_thousands, field) for field in fields]
        if self.has_decimal_comma:
            fields = [field.replace(b",", b".") for field in fields]
        return self.separator.join(field.replace(self.separator, b" ") for field in fields)

    def _cells(self, line: bytes) -> list[str]:
        text, sign = line.decode("latin-1").replace("\r", " "), self.delimiter.decode()
        try:
            cells = next(csv.reader([text.strip() if sign == " " else text], delimiter=sign, skipinitialspace=True), [])
        except csv.Error:  # a field of more than 128 KiB
            cells = text.split(sign)
        return [cell for cell in cells if cell] if sign == " " else cells


_TEXT = re.compile(r"""['"]([^'"]+)['"]""")


def _join_thousands(number: re.Match[bytes]) -> bytes:
    return number[0].translate(None, b".,")


_LIST = re.compile(r"\s*[\[({](.*)[\])}]\s*", re.DOTALL)


def _is_list(cell: str) -> bool:
    """Whether a cell is a list of numbers, in brackets or between blanks; ``[rad]`` is none."""
    return _elements(cell) != [cell]


def _elements(cell: str) -> list[str]:
    """Numbers of a list; else the cell."""
    bracketed = _LIST.fullmatch(cell)
    elements = cell.split() if bracketed is None else re.split(r"[\s,;]+", bracketed[1].strip(" \t,;"))
    is_list = all(is_number(each.encode("latin-1", "replace")) for each in elements[: None if bracketed is None else 1])
    return elements if is_list and (bracketed or len(elements) > 1) else [cell]


def find_first_row(lines: Sequence[bytes], sign: bytes | None) -> tuple[int, Dialect] | None:
    """The first of the lines of numbers that are as wide as most, and its dialect, by `sign` or as the lines show it.

    None where there is none. Lines of numbers before them, such as a count of the channels, are shorter.
    """
    rows: list[tuple[int, int, Dialect]] = []
    for index, line in enumerate(lines):
        if is_comment(line):
            continue
        dialect = Dialect(find_delimiter(line) if sign is None else sign)
        fields = replace(dialect, has_decimal_comma=dialect.shows_decimal_comma([line])).split(line)
        if len(fields) > 2 and 2 * sum(map(is_number, fields)) > len(fields):
            rows.append((len(fields), index, dialect))
        if len(rows) == _ROWS_SEEN:
            break
    widths = [width for width, _, _ in rows]
    width = max(widths, key=lambda width: (widths.count(width), width), default=0)
    return next(((index, dialect) for found, index, dialect in rows if found == width), None)


def is_comment(line: bytes) -> bool:
    """Whether a line is for people: ``# …``, or ``% …`` as MATLAB writes it."""
    return line.lstrip().startswith((b"#", b"% "))


def _has_cells(text: bytes) -> bool:
    """Whether quotes or brackets hold fields together."""
    return b'"' in text or b"[" in text


def find_delimiter(line: bytes) -> bytes:
    """The sign that a line of names or numbers is separated by; decimal commas are none."""
    for sign in _SHOWN_BY:
        if sign in line and all(b"," not in field or _is_decimal(field) for field in line.split(sign)):
            return sign
    blank = line.split()
    if len(blank) > 1 and (b"," not in line or all(map(_is_decimal, blank))):
        return BLANK
    return next((sign for sign in (b",", *_SHOWN_BY) if sign in line), b",")


def _is_decimal(field: bytes) -> bool:
    """Whether a field is a number or a date, its decimals behind a point or a comma."""
    text = field.strip(b' \t\r"')
    return is_number(text) or any(kind.fullmatch(text) for kind in (_DECIMAL_COMMA, _GERMAN_DATE))
