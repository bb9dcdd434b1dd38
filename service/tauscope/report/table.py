"""A table of words and numbers, wherever it is shown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


def csv_text(columns: Mapping[str, Sequence[float]]) -> str:
    """A heading line, then a line a sample."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(f"{value:.5g}" for value in row) for row in rows)])


@dataclass(frozen=True)
class Table:
    """Cells as text."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1
