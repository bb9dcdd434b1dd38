"""A table of words and numbers, wherever it is shown."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Cells as text.

    columns : sequence of str
        headings
    rows : sequence of sequences of str
        cells
    words : int
        number of leading columns that hold words; the others hold numbers
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1
