"""A Gauss–Newton step within limits, against the same problem solved by a general solver."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from tauscope.diagnosis.fitting.bounded_step import bounded_step

PARAMETERS, CURVED = 6, np.array([2, 4, 5])


@given(seed=st.integers(0, 10_000), room=st.floats(0.01, 3.0))
def test_it_is_the_best_step_within_its_limits(seed: int, room: float) -> None:
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((20, PARAMETERS)) * [1.0, 10.0, 1.0, 0.1, 3.0, 1.0]
    target = 5.0 * rng.standard_normal(20)
    spread = np.linalg.inv(np.linalg.qr(columns, mode="r"))
    free = spread @ spread.T @ columns.T @ target
    lower, upper = -room * rng.random(3), room * rng.random(3)
    found = bounded_step(free, spread, CURVED, lower, upper, np.array([0.4, 1.0, 2.0]))
    low, high = np.full(PARAMETERS, -np.inf), np.full(PARAMETERS, np.inf)
    low[CURVED], high[CURVED] = lower, upper
    assert (found[CURVED] >= lower - 1e-12).all()
    assert (found[CURVED] <= upper + 1e-12).all()
    best = lsq_linear(columns, target, bounds=(low, high), method="bvls").x
    energy = float(np.sum((target - columns @ best) ** 2))
    assert float(np.sum((target - columns @ found) ** 2)) == pytest.approx(energy, rel=1e-6)


def test_a_step_within_its_limits_is_left_as_it_is() -> None:
    step = np.array([4.0, -0.2])
    found = bounded_step(step, np.eye(2), np.array([1]), np.array([-0.3]), np.array([0.3]), np.array([0.4]))
    assert found is step


def test_a_column_of_next_to_nothing_leads_nowhere_far() -> None:
    """A constant of a friction that is all but zero: its own step would be 1e20."""
    step, spread = np.array([1.0, 1e20, 0.5]), np.diag([1.0, 1e21, 1.0])
    limits = np.array([-0.4, -0.1]), np.array([0.4, 0.1])
    found = bounded_step(step, spread, np.array([1, 2]), *limits, np.array([0.4, 1.0]))
    np.testing.assert_allclose(found, [1.0, 0.4, 0.1])
