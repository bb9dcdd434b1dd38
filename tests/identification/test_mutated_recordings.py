"""Whatever happens to a recording's text: a sound answer or one line of refusal, and the file left alone."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.simulated import PAPER_NOISE, paper_robot, simulate
from tauscope.errors import TauscopeError
from tauscope.identification import document, identify
from tauscope.recording import read_recording

Rows = list[list[str]]
ARM = simulate(paper_robot(), seed=1)
NAMES = ["t", "q1", "q2", "q3", "tau1", "tau2", "tau3", "period"]
ROWS = 400
MAY_BE_NULL = ("std", "delta", "cutoff_hz", "held_out", "joint", "extrapolation", "predicted_rms")


def table() -> Rows:
    samples = ARM.recording(ARM.white(PAPER_NOISE, np.random.default_rng(0))).samples(0, ROWS)
    columns = np.column_stack([samples.time, samples.position, samples.effort])
    return [[*(repr(float(value)) for value in row), str(index * 2 // ROWS)] for index, row in enumerate(columns)]


TABLE = table()


def of_column(change: Callable[[str], str]) -> Callable[[Rows, int, int], Rows]:
    return lambda rows, _, column: [[*row[:column], change(row[column]), *row[column + 1 :]] for row in rows]


def of_field(text: str) -> Callable[[Rows, int, int], Rows]:
    def change(rows: Rows, row: int, column: int) -> Rows:
        return [[*r[:column], text, *r[column + 1 :]] if place == row else r for place, r in enumerate(rows)]

    return change


def scaled(factor: float) -> Callable[[str], str]:
    return lambda text: repr(float(text) * factor) if text.strip("-").replace(".", "").isdigit() else text


MUTATIONS: list[Callable[[Rows, int, int], Rows]] = [
    *(of_field(text) for text in ("", "nan", "1e12", "-1e8", "3.3", "abc", "inf", "1,2")),
    *(of_column(lambda _, text=text: text) for text in ("0", "1.5", "nan", "1e-300", "1e9", "")),
    *(of_column(scaled(factor)) for factor in (1e-12, 1e-6, 1e6, 1e9, -1.0)),
    lambda rows, row, _: rows[:row],
    lambda rows, row, _: rows[row:],
    lambda rows, row, column: rows[:row] + rows[row + 30 * column :],
    lambda rows, row, _: [*rows[: row + 1], *rows[row:]],
    lambda rows, row, column: [
        [*r[:column], "nan", *r[column + 1 :]] if (place * 7 + row) % 3 == 0 else r for place, r in enumerate(rows)
    ],
]

STEPS = st.lists(
    st.tuples(st.sampled_from(MUTATIONS), st.integers(0, ROWS - 1), st.integers(0, len(NAMES) - 1)),
    min_size=1,
    max_size=4,
)


def nulls_and_infinities(value: object, path: str = "") -> list[str]:
    if isinstance(value, dict):
        return [found for key, item in value.items() for found in nulls_and_infinities(item, f"{path}.{key}")]
    if isinstance(value, list):
        return [found for item in value for found in nulls_and_infinities(item, path)]
    if value is None:
        return [] if any(name in path.split(".") for name in MAY_BE_NULL) else [path]
    return [path] if isinstance(value, float) and not math.isfinite(value) else []


def check(folder: Path, steps: list[tuple[Callable[[Rows, int, int], Rows], int, int]]) -> None:
    rows = TABLE
    for mutation, row, column in steps:
        rows = mutation(rows, row, column)
    text = "\n".join(",".join(row) for row in [NAMES, *rows]) + "\n"
    path = folder / "mutated.csv"
    path.write_text(text)
    refusal = None
    try:
        result = identify(ARM.robot, [read_recording(path, 3)])
        assert nulls_and_infinities(json.loads(document(result).model_dump_json(by_alias=True))) == []
    except TauscopeError as error:
        refusal = str(error)
    assert refusal is None or ("mutated.csv" in refusal and "\n" not in refusal)
    assert path.read_text() == text


@given(steps=STEPS)
def test_a_mutated_recording(tmp_path_factory: pytest.TempPathFactory, steps: list) -> None:
    check(tmp_path_factory.getbasetemp(), steps)


@pytest.mark.proof
@pytest.mark.timeout(1800)
@settings(max_examples=2000)
@given(steps=STEPS)
def test_two_thousand_mutated_recordings(tmp_path_factory: pytest.TempPathFactory, steps: list) -> None:
    check(tmp_path_factory.getbasetemp(), steps)
