"""Weighted rows are white where their errors are, each one's own and those that all share."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.diagnosis.observations.whitening import RowWeighting


@given(st.integers(0, 2**32 - 1), st.integers(0, 3), st.floats(0.0, 30.0))
def test_errors_of_the_stated_covariance_become_white(seed: int, shared_count: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.1, 1.0, 12)
    shared = size * rng.standard_normal((shared_count, 12))
    covariance = np.diag(weights**-2) + (shared / weights).T @ (shared / weights)
    applied = RowWeighting.of(weights, shared).applied(np.eye(12))  # row i: what becomes of unit vector i
    assert applied.T @ covariance @ applied == pytest.approx(np.eye(12), abs=1e-9)


def test_certain_rows_stay_as_they_are() -> None:
    rows = np.random.default_rng(3).standard_normal((4, 9))
    assert RowWeighting.of(np.ones(9), np.zeros((2, 9))).applied(rows) == pytest.approx(rows)
