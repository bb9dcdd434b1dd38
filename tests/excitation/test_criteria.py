"""Criteria against numpy.linalg, and their gradients."""

import numpy as np
import pytest

from excitation.excited_arms import Array, derivative_along
from tauscope.excitation.information import Criterion, criterion_value, reported_value


def regressor(seed: int, rows: int = 60, columns: int = 9) -> Array:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(rows, columns)) * rng.uniform(0.1, 3.0, columns)


@pytest.mark.parametrize("seed", range(5))
def test_values_are_those_of_numpy(seed: int) -> None:
    matrix = regressor(seed)
    gram = matrix.T @ matrix
    frobenius = np.linalg.norm(gram) * np.linalg.norm(np.linalg.inv(gram))
    expected = {
        Criterion.COND_F: frobenius,
        Criterion.LOG_DET: -np.linalg.slogdet(gram)[1] / len(gram),
        Criterion.COND_2: np.linalg.cond(matrix),
    }
    for criterion, value in expected.items():
        found = criterion_value(criterion, gram)
        assert reported_value(criterion, found.own) == pytest.approx(value, rel=1e-9)
        assert found.condition_number == pytest.approx(np.linalg.cond(matrix), rel=1e-9)
        assert found.cost == found.own


@pytest.mark.parametrize("criterion", list(Criterion))
@pytest.mark.parametrize("weight", [0.0, 0.7])
def test_gradients_match_finite_differences(criterion: Criterion, weight: float) -> None:
    matrix = regressor(7)
    gram = matrix.T @ matrix / len(matrix)
    rng = np.random.default_rng(0)
    found = criterion_value(criterion, gram, weight)
    for _ in range(5):
        way = rng.normal(size=gram.shape)
        way = (way + way.T) * 0.05
        expected = derivative_along(lambda a: criterion_value(criterion, a, weight).cost, gram, way, 1e-3)
        assert float((found.gradient * way).sum()) == pytest.approx(expected, rel=1e-6)


def test_the_share_of_the_volume_is_added_to_condition_numbers_alone() -> None:
    matrix = regressor(3)
    gram = matrix.T @ matrix
    volume = criterion_value(Criterion.LOG_DET, gram).own
    both = criterion_value(Criterion.COND_F, gram, 0.5)
    assert both.cost == pytest.approx(both.own + 0.5 * volume)
    assert criterion_value(Criterion.LOG_DET, gram, 0.5).cost == pytest.approx(volume)


def test_a_parameter_that_is_not_excited_costs_infinitely_much() -> None:
    matrix = regressor(1)
    matrix[:, 4] = matrix[:, 2]
    found = criterion_value(Criterion.COND_F, matrix.T @ matrix)
    assert found.cost == np.inf
    assert not found.gradient.any()


def test_log_det_does_not_depend_on_units_and_condition_numbers_do() -> None:
    matrix = regressor(2)
    scaled = matrix * np.array([1.0, 1000.0, *np.ones(7)])
    plain, other = ({c: criterion_value(c, m.T @ m).own for c in Criterion} for m in (matrix, scaled))
    assert other[Criterion.LOG_DET] - plain[Criterion.LOG_DET] == pytest.approx(-2.0 * np.log(1000.0) / 9)
    assert other[Criterion.COND_2] > plain[Criterion.COND_2] + 3.0
