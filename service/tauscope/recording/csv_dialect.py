"""How a text file separates its fields and writes its decimals, by what it says or shows."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from tauscope.recording.csv_numbers import is_number

BLANK = b" "

_SHOWN_BY = (b";", b"\t", b"|")
_DECIMAL_COMMA = re.compile(rb"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")


@dataclass(frozen=True)
class Dialect:
    """Signs of a text file; `normalize` makes text with decimal points, and commas where blanks were."""

    delimiter: bytes
    has_decimal_comma: bool = False

    @property
    def separator(self) -> bytes:
        """What separates the fields of normal text."""
        return b"," if self.delimiter == BLANK else self.delimiter

    def normalize(self, text: bytes) -> bytes:
        """Whole lines, written with decimal points and without runs of blanks."""
        if self.has_decimal_comma:
            text = text.replace(b",", b".")
        if self.delimiter != BLANK:
            return text
        return b"\n".join(b",".join(line.split()) for line in text.split(b"\n"))

    def split(self, line: bytes) -> list[bytes]:
        """Fields of a line, without blanks and quotes around them."""
        return [field.strip(b' \t\r"') for field in self.normalize(line).split(self.separator)]


def find_delimiter(line: bytes) -> bytes:
    """The sign that a line of names or numbers is separated by; decimal commas are none."""
    for sign in _SHOWN_BY:
        if sign in line and all(b"," not in field or _is_decimal(field) for field in line.split(sign)):
            return sign
    blank = line.split()
    if len(blank) > 1 and (b"," not in line or all(map(_is_decimal, blank))):
        return BLANK
    return next((sign for sign in (b",", *_SHOWN_BY) if sign in line), b",")


def find_decimal_comma(lines: Sequence[bytes], delimiter: bytes) -> bool:
    """Whether lines of numbers write decimals with a comma: some do, and none has a point."""
    if delimiter == b",":
        return False
    fields = [field for line in lines for field in (line.split() if delimiter == BLANK else line.split(delimiter))]
    commas = any(_DECIMAL_COMMA.fullmatch(field.strip()) for field in fields)
    return commas and not any(is_number(field) and b"." in field for field in fields)


def _is_decimal(field: bytes) -> bool:
    """Whether a field is a number, its decimals behind a point or a comma."""
    return is_number(field) or _DECIMAL_COMMA.fullmatch(field.strip(b' \t\r"')) is not None
