"""Delimiter, decimal sign, quotes and lists of a text file."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from tauscope.recording.csv_numbers import is_number

_KNOWN: Mapping[str, Mapping[str, str]] = {
    "t": {"s": "s", "sec": "s", "seconds": "s", "ms": "ms", "us": "us", "µs": "us", "ns": "ns"},
    "q": {"rad": "rad", "deg": "deg", "°": "deg", "degrees": "deg", "m": "m", "mm": "mm"},
    "qd": {"rad/s": "rad", "deg/s": "deg", "°/s": "deg", "rpm": "rpm", "1/min": "rpm", "m/s": "m", "mm/s": "mm"},
    "qdd": {"rad/s^2": "rad", "rad/s2": "rad", "rad/s²": "rad", "m/s^2": "m", "m/s2": "m", "m/s²": "m"},
    "tau": {"Nm": "Nm", "N*m": "Nm", "N·m": "Nm", "N m": "Nm", "N": "N", "A": "A", "mA": "mA"},
}
_LIKE: Mapping[str, str] = {"i": "tau", "qref": "q", "qlink": "q", "taucmd": "tau"}
_FREE = ("temp", "period")  # groups whose units are not looked at


def read_units_row(names: Sequence[str], cells: Sequence[str]) -> dict[str, str] | None:
    """Units as a robot file states them, None where a cell holds no unit of its column.

    `names`: columns of CONTRACT.md; `cells`: cells of the row, one for each of them.
    """
    units: dict[str, str] = {}
    for name, cell in zip(names, cells, strict=True):
        group = name.rstrip("0123456789")
        if group in _FREE:
            continue
        root = _LIKE.get(group, group)
        unit = _KNOWN[root].get(re.sub(r"^[\[({]\s*|\s*[\])}]$", "", cell.strip(' "')))
        if unit is None:
            return None
        key = root if root in ("t", "tau") else name
        if group not in ("t", "q", "qd", "tau", "i"):
            continue  # they follow
        if units.setdefault(key, unit) != unit:
            return None  # torques in two units
    return units


BLANK = b" "

_SHOWN_BY = (b";", b"\t", b"|")
_DECIMAL_COMMA = re.compile(rb"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")


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
        if self.has_decimal_comma:
            text = text.replace(b",", b".")
        if self.delimiter != BLANK:
            return text
        return b"\n".join(b",".join(line.split()) for line in text.split(b"\n"))

    def split(self, line: bytes) -> list[bytes]:
        """Fields of a line, without blanks and quotes around them."""
        return [field.strip(b' \t\r"') for field in self.normalize(line).split(self.separator)]

    def name_fields(self, header: bytes, row: bytes) -> list[bytes]:
        """Names of a row's fields: a name whose cell is a list stands for its elements, numbered from 0."""
        names, cells = self._cells(header), self._cells(row)
        if len(names) != len(cells):
            return [name.strip().encode("latin-1") for name in names]
        found = []
        for name, cell in zip(names, cells, strict=True):
            text = name.strip().encode("latin-1")
            elements = range(len(_elements(cell)))
            found += [b"%s[%d]" % (text, element) for element in elements] if _is_list(cell) else [text]
        return found

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
        return commas and not any(is_number(field) and b"." in field for field in fields)

    def _open_cells(self, line: bytes) -> bytes:
        if line.lstrip().startswith(b"#"):
            return line
        fields = [field for cell in self._cells(line.rstrip(b"\r")) for field in _elements(cell)]
        if self.has_decimal_comma:
            fields = [field.replace(",", ".") for field in fields]
        sign = self.separator.decode()
        return self.separator.join(field.replace(sign, " ").encode("latin-1") for field in fields)

    def _cells(self, line: bytes) -> list[str]:
        """Cells of a line, without quotes."""
        text, sign = line.decode("latin-1").replace("\r", " "), self.delimiter.decode()
        try:
            cells = next(csv.reader([text.strip() if sign == " " else text], delimiter=sign, skipinitialspace=True), [])
        except csv.Error:  # a field of more than 128 KiB
            cells = text.split(sign)
        return [cell for cell in cells if cell] if sign == " " else cells


def _is_list(cell: str) -> bool:
    """Whether a cell is a list of numbers in brackets; ``[rad]`` is none."""
    text = cell.strip()
    first = text[1:].replace(",", " ").split()[:1]
    return (
        text.startswith("[") and text.endswith("]") and bool(first) and is_number(first[0].encode("latin-1", "replace"))
    )


def _elements(cell: str) -> list[str]:
    """Elements of a list, or the cell itself."""
    return cell.strip()[1:-1].replace(",", " ").split() if _is_list(cell) else [cell]


def find_first_row(lines: Sequence[bytes], sign: bytes | None) -> tuple[int, Dialect] | None:
    """The first line of numbers and its dialect; None where there is none.

    `sign`: delimiter, None where the lines show it.
    """
    for index, line in enumerate(lines):
        if line.strip().startswith(b"#"):
            continue
        delimiter = find_delimiter(line) if sign is None else sign
        dialect = Dialect(delimiter)
        fields = replace(dialect, has_decimal_comma=dialect.shows_decimal_comma([line])).split(line)
        numbers = sum(map(is_number, fields))
        if len(fields) > 2 and 2 * numbers > len(fields):
            return index, dialect
    return None


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
    """Whether a field is a number, its decimals behind a point or a comma."""
    return is_number(field) or _DECIMAL_COMMA.fullmatch(field.strip(b' \t\r"')) is not None
