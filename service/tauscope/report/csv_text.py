"""Columns of numbers as comma-separated text."""

from collections.abc import Mapping, Sequence


def csv_text(columns: Mapping[str, Sequence[float]]) -> str:
    """A heading line, then a line a sample."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(f"{value:.5g}" for value in row) for row in rows)])
