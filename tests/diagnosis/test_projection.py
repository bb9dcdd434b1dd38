"""Frisch–Waugh–Lovell moments against dense least squares, and their distribution where nothing is missing."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from tauscope.diagnosis.findings.detectability import effective_number
from tauscope.diagnosis.fitting.projection import JointColumns, Moments, moments, project

Array = NDArray[np.float64]

ROWS = (120, 90)


def design(rng: np.random.Generator) -> tuple[list[JointColumns], Array, int]:
    """Two joints that share columns 0 to 2 and have own ones; the same as one dense matrix."""
    index = [np.array([0, 1, 2, 3]), np.array([0, 1, 2, 4, 5])]
    columns = [JointColumns(own, rng.standard_normal((len(own), rows))) for own, rows in zip(index, ROWS, strict=True)]
    dense = np.zeros((sum(ROWS), 6))
    first = 0
    for own in columns:
        dense[first : first + own.rows.shape[1], own.index] = own.rows.T
        first += own.rows.shape[1]
    return columns, dense, 6


def split(values: Array) -> list[Array]:
    return np.split(values, [ROWS[0]])


def gains(found: Moments) -> Array:
    """What each shape takes off the residual's energy, (g,)."""
    solved = np.linalg.solve(found.gram, found.target[..., None])[..., 0]
    return np.asarray(np.sum(solved * found.target, axis=1))


def energy(matrix: Array, target: Array) -> float:
    solved = np.linalg.lstsq(matrix, target)[0]
    return float(np.sum((target - matrix @ solved) ** 2))


def test_the_projection_is_the_dense_least_squares_fit() -> None:
    rng = np.random.default_rng(1)
    columns, dense, size = design(rng)
    target = rng.standard_normal(sum(ROWS))
    fitted = project(columns, split(target), size)
    assert fitted.step == pytest.approx(np.linalg.lstsq(dense, target)[0])
    assert fitted.energy == pytest.approx(energy(dense, target))
    assert fitted.spread @ fitted.spread.T == pytest.approx(np.linalg.inv(dense.T @ dense))


@pytest.mark.parametrize("touched", [(0,), (1,), (0, 1)])
def test_a_candidates_gain_is_what_a_dense_fit_gains_by_its_columns(touched: tuple[int, ...]) -> None:
    rng = np.random.default_rng(2)
    columns, dense, size = design(rng)
    target = rng.standard_normal(sum(ROWS))
    fitted = project(columns, split(target), size)
    candidate = {joint: rng.standard_normal((5, 2, ROWS[joint])) for joint in touched}
    gained = gains(moments(fitted, candidate))
    for shape in range(5):
        added = np.zeros((sum(ROWS), 2))
        for joint, rows in candidate.items():
            start = 0 if joint == 0 else ROWS[0]
            added[start : start + ROWS[joint]] = rows[shape].T
        both = np.hstack([dense, added])
        assert gained[shape] == pytest.approx(energy(dense, target) - energy(both, target))


def test_a_candidate_within_the_nominal_columns_is_invisible() -> None:
    rng = np.random.default_rng(4)
    columns, _, size = design(rng)
    fitted = project(columns, split(rng.standard_normal(sum(ROWS))), size)
    inside = (columns[0].rows[3] + 0.0)[None, None]
    found = moments(fitted, {0: inside})
    assert found.shares[0, 0] < 1e-12


def test_what_is_known_beforehand_counts_as_rows() -> None:
    rng = np.random.default_rng(5)
    columns, dense, size = design(rng)
    target = rng.standard_normal(sum(ROWS))
    prior = np.zeros((1, size))
    prior[0, 3] = 4.0
    fitted = project(columns, split(target), size, (prior, np.array([2.0])))
    whole, values = np.vstack([dense, prior]), np.append(target, 2.0)
    assert fitted.step == pytest.approx(np.linalg.lstsq(whole, values)[0])
    assert fitted.energy == pytest.approx(energy(whole, values))


def test_gains_of_noise_follow_the_chi_square_law() -> None:
    rng = np.random.default_rng(6)
    columns, _, size = design(rng)
    candidate = {1: rng.standard_normal((1, 2, ROWS[1]))}
    gained = []
    for _ in range(400):
        fitted = project(columns, split(rng.standard_normal(sum(ROWS))), size)
        gained.append(float(gains(moments(fitted, candidate))[0]))
    assert stats.kstest(gained, stats.chi2(2).cdf).pvalue > 1e-3
    # A law with another number of degrees of freedom is rejected: the test has power.
    assert stats.kstest(gained, stats.chi2(3).cdf).pvalue < 1e-6


def test_the_largest_gain_of_a_grid_follows_its_effective_number() -> None:
    rng = np.random.default_rng(7)
    columns, _, size = design(rng)
    angles = np.linspace(0.0, 8.0, 24)
    base = rng.standard_normal((9, ROWS[0]))
    rows = np.stack([[np.cos(a) * base[int(a)] + np.sin(a) * base[int(a) + 1 - 1 * (a >= 8)]] for a in angles])
    candidate = {0: rows}
    fitted = project(columns, split(rng.standard_normal(sum(ROWS))), size)
    number = effective_number(moments(fitted, candidate), candidate, rng)
    assert 1.0 < number <= 24.0
    largest = []
    for _ in range(2000):
        fitted = project(columns, split(rng.standard_normal(sum(ROWS))), size)
        largest.append(float(gains(moments(fitted, candidate)).max()))
    share = np.mean(np.minimum(1.0, number * stats.chi2.sf(np.array(largest), 1)) < 0.02)
    assert 0.008 < share < 0.035


def test_one_shape_many_times_counts_once_and_orthogonal_shapes_count_each() -> None:
    rng = np.random.default_rng(8)
    columns, _, size = design(rng)
    fitted = project(columns, split(rng.standard_normal(sum(ROWS))), size)
    same = {0: np.tile(rng.standard_normal(ROWS[0]), (10, 1, 1))}
    assert effective_number(moments(fitted, same), same, rng) < 1.3
    apart = {0: np.linalg.qr(rng.standard_normal((ROWS[0], 10)))[0].T[:, None]}
    assert effective_number(moments(fitted, apart), apart, rng) > 8.0
