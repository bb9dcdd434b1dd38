"""A pursuit in the Gram matrix leaves what one that makes every column orthogonal would."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tauscope.diagnosis.noise.pursuit import BEYOND_CHANCE, MOST_TAKEN, ROWS_A_COLUMN, SAME_COLUMN, pursued
from tauscope.recording.recording import Array

ROWS = 400


def plainly(columns: Array, residual: Array) -> tuple[Array, int]:
    """What is left, not scaled, and how many columns were taken."""
    unit = columns / np.linalg.norm(columns, axis=1, keepdims=True)
    chance, taken, left = 2.0 * np.log(len(unit)) + BEYOND_CHANCE, np.zeros((0, ROWS)), residual
    for _ in range(min(MOST_TAKEN, ROWS // ROWS_A_COLUMN)):
        outside = unit - np.linalg.lstsq(taken.T, unit.T)[0].T @ taken
        norms = np.linalg.norm(outside, axis=1)
        scores = np.where(norms > SAME_COLUMN, outside @ residual / np.maximum(norms, SAME_COLUMN), 0.0)
        best = int(np.argmax(np.abs(scores)))
        if scores[best] ** 2 < chance * float(left @ left) / ROWS:
            break
        taken = np.concatenate([taken, unit[best : best + 1]])
        left = residual - np.linalg.lstsq(taken.T, residual)[0] @ taken
    return left, len(taken)


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(0, 8), st.floats(0.0, 4.0))
def test_it_leaves_what_plain_orthogonalisation_does(seed: int, count: int, telling: int, decades: float) -> None:
    rng = np.random.default_rng(seed)
    columns = np.cumsum(rng.normal(size=(count, ROWS)), axis=1)  # much alike
    residual = rng.normal(size=ROWS) + rng.normal(size=telling) @ columns[rng.integers(0, count, telling)] * 0.1
    expected, taken = plainly(columns, residual)
    found = pursued(columns * 10.0 ** rng.uniform(-decades, decades, (count, 1)), residual)
    scale = ROWS / max(ROWS - 2.0 * np.log(count) * taken, 0.2 * ROWS)
    np.testing.assert_allclose(found, expected * np.sqrt(scale), atol=1e-6 * float(np.linalg.norm(residual)))


def test_noise_is_left_as_it_is() -> None:
    rng = np.random.default_rng(1)
    residual = rng.normal(size=ROWS)
    np.testing.assert_array_equal(pursued(rng.normal(size=(50, ROWS)), residual), residual)


def test_without_columns_nothing_is_explained() -> None:
    residual = np.ones(ROWS)
    assert pursued(np.zeros((0, ROWS)), residual) is residual
    assert pursued(np.zeros((3, ROWS)), residual) is residual
