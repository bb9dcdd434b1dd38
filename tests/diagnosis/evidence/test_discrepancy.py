"""Torque without a name: nothing that the model can say itself."""

from types import SimpleNamespace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.nominal_arm import nominal_rows
from tauscope.diagnosis.evidence.discrepancy import Reach, beyond, smooth_features


@given(st.integers(0, 10_000), st.floats(1e-6, 1e6))
def test_features_hold_nothing_of_the_columns_whatever_their_unit(seed: int, unit: float) -> None:
    draws = np.random.default_rng(seed)
    columns, features = draws.standard_normal((4, 50)), draws.standard_normal((9, 50))
    columns[0] *= unit
    columns[3] = columns[1] + columns[2]
    found = beyond(columns, features)
    np.testing.assert_allclose(found @ columns.T / np.linalg.norm(columns, axis=1), 0.0, atol=1e-9)
    basis = np.linalg.qr(columns[:3].T)[0]
    np.testing.assert_allclose(found, features - (features @ basis) @ basis.T, atol=1e-6)


def test_a_column_that_is_nothing_takes_nothing_away() -> None:
    features = np.random.default_rng(0).standard_normal((3, 20))
    np.testing.assert_array_equal(beyond(np.zeros((2, 20)), features), features)


def test_a_joint_that_stands_has_finite_features() -> None:
    """No ratio to a range that is none may overflow: a warning is an error here."""
    motion = SimpleNamespace(position=np.full((9, 3), 0.5), velocity=np.zeros((9, 3)))
    reach = Reach.of([SimpleNamespace(prepared=SimpleNamespace(motion=motion))])  # type: ignore[arg-type]
    rows, _ = smooth_features(*nominal_rows(), 1, reach)
    assert np.isfinite(rows).all()
