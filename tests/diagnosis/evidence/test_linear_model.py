"""Evidence, slopes and held parameters against a multivariate normal distribution that is written out in full."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from tauscope.diagnosis.evidence.linear_model import LinearModel
from tauscope.diagnosis.evidence.moments import JointMoments
from tauscope.diagnosis.evidence.scales import REST_SHARES, Scales

Array = NDArray[np.float64]

GROUPS = np.array([0, 0, 1, 1, 2, 2, -1, -1])
BOUNDS = np.array([0, 20, 28, 28, 40])
COUNTS = np.diff(BOUNDS).astype(np.float64)
ROWS = int(BOUNDS[-1])
PLACES = (np.array([0, 1, 2]), np.array([1, 2, 3]))


@dataclass(frozen=True)
class Problem:
    """Two joints that share two of four parameters."""

    model: LinearModel
    targets: list[Array]
    columns: list[Array]
    features: list[Array]
    scales: list[Scales]

    def log_density(self, extra: Array | None = None, std: Array | None = None) -> float:
        """Log p(y) with C and the parameters' covariance written out, but for log 2π."""
        size = 4 + (0 if extra is None else len(extra))
        columns, noise = np.zeros((size, 2 * ROWS)), np.zeros((2 * ROWS, 2 * ROWS))
        rest = np.repeat(REST_SHARES, np.diff(BOUNDS))
        for joint, scales in enumerate(self.scales):
            own = slice(ROWS * joint, ROWS * (joint + 1))
            columns[PLACES[joint], own] = self.columns[joint]
            spread = self.features[joint] * scales.amplitudes(GROUPS)[:, None]
            variance = np.exp(2.0 * scales.values[0]) * (1.0 + np.exp(2.0 * scales.values[-1]) * rest**2)
            noise[own, own] = np.diag(variance) + spread.T @ spread
        covariance = np.zeros((size, size))
        covariance[:4, :4] = np.linalg.inv(self.model.precision)
        mean = np.zeros(size)
        mean[:4] = self.model.mean
        if extra is not None and std is not None:
            columns[4:, :ROWS] = extra
            covariance[4:, 4:] = np.diag(std**2)
        whole = multivariate_normal(columns.T @ mean, noise + columns.T @ covariance @ columns)
        return float(whole.logpdf(np.concatenate(self.targets))) + ROWS * float(np.log(2.0 * np.pi))


def problem(seed: int) -> Problem:
    draws = np.random.default_rng(seed)
    targets, columns, features = (
        [draws.standard_normal((*shape, ROWS)) for _ in PLACES] for shape in ((), (3,), (len(GROUPS),))
    )
    joints = tuple(
        JointMoments.of(index, *rows, BOUNDS, COUNTS, GROUPS)
        for index, rows in zip(PLACES, zip(targets, columns, features, strict=True), strict=True)
    )
    root = draws.standard_normal((4, 4))
    model = LinearModel(joints, draws.standard_normal(4), root @ root.T + np.eye(4))
    scales = [Scales(0.3 * draws.standard_normal(5), 1.0) for _ in PLACES]
    return Problem(model, targets, columns, features, scales)


SEEDS = st.integers(0, 10_000)


@settings(max_examples=20)
@given(SEEDS)
def test_evidence_is_that_of_the_multivariate_normal(seed: int) -> None:
    case = problem(seed)
    assert case.model.posterior(case.scales).log_evidence == pytest.approx(case.log_density(), abs=1e-7)


@settings(max_examples=20)
@given(SEEDS)
def test_more_parameters_count_as_if_they_had_been_there(seed: int) -> None:
    case, draws = problem(seed), np.random.default_rng([seed, 1])
    extra, std = draws.standard_normal((2, ROWS)), draws.uniform(0.2, 3.0, 2)
    found = case.model.extend({0: extra}, np.zeros(2), std)
    assert found.posterior(case.scales).log_evidence == pytest.approx(case.log_density(extra, std), abs=1e-7)


@settings(max_examples=20)
@given(SEEDS, st.floats(-3.0, 3.0))
def test_a_parameter_that_is_held_is_one_that_is_known(seed: int, value: float) -> None:
    case = problem(seed)
    held = case.model.without(np.array([2]), np.array([value]))
    parts = zip(case.targets, case.columns, PLACES, strict=True)
    targets = [y - value * x[np.flatnonzero(at == 2)[0]] for y, x, at in parts]
    columns = [x[at != 2] for x, at in zip(case.columns, PLACES, strict=True)]
    joints = tuple(
        JointMoments.of(at[at != 2], y, x, b, BOUNDS, COUNTS, GROUPS)
        for at, y, x, b in zip(PLACES, targets, columns, case.features, strict=True)
    )
    expected = LinearModel(joints, case.model.mean, case.model.precision)
    assert held.posterior(case.scales).log_evidence == pytest.approx(
        expected.posterior(case.scales).log_evidence, abs=1e-7
    )


@settings(max_examples=20)
@given(SEEDS)
def test_slopes_of_the_evidence_are_its_differences(seed: int) -> None:
    case = problem(seed)
    posterior = case.model.posterior(case.scales)
    own = case.model.joints[0]
    direction = np.concatenate([[1.0], -posterior.mean[own.index]])
    covariance = posterior.covariance[np.ix_(own.index, own.index)]
    slopes = 0.5 * own.slopes(case.scales[0], direction, covariance) + case.scales[0].penalty_slopes()

    def evidence(values: Array) -> float:
        return case.model.evidence([Scales(values, 1.0), case.scales[1]])

    step, values = 1e-5, case.scales[0].values
    differences = [(evidence(values + step * each) - evidence(values - step * each)) / (2 * step) for each in np.eye(5)]
    np.testing.assert_allclose(slopes, -np.array(differences), rtol=1e-4, atol=1e-4)


def test_scales_of_highest_evidence_are_those_that_made_the_rows() -> None:
    found: list[Sequence[float]] = []
    for seed in range(6):
        draws = np.random.default_rng(seed)
        bounds, groups = np.array([0, 900, 900, 900, 1200]), np.zeros(60, dtype=np.intp)
        counts = np.diff(bounds).astype(np.float64)
        columns, features = draws.standard_normal((3, 1200)), draws.standard_normal((60, 1200))
        noise = 2.0 * draws.standard_normal(1200) * np.where(np.arange(1200) < 900, 1.0, np.sqrt(1.0 + 9.0))
        target = columns.sum(axis=0) + 0.5 * draws.standard_normal(60) @ features + noise
        own = JointMoments.of(np.arange(3), target, columns, features, bounds, counts, groups)
        model = LinearModel((own,), np.zeros(3), np.eye(3))
        (scales,) = model.most_probable([Scales.start(4.0)], [0])
        found.append([np.exp(scales.values[0]), np.exp(scales.values[1]), np.exp(scales.values[-1])])
    np.testing.assert_allclose(np.mean(found, axis=0), [2.0, 0.5, 3.0], rtol=0.08)


@settings(max_examples=20)
@given(SEEDS, st.floats(-3.0, 3.0))
def test_a_parameter_that_is_held_keeps_its_value_and_tells_the_others_what_was_believed(
    seed: int, value: float
) -> None:
    """Of the others, the conditional mean of the prior is believed."""
    case = problem(seed)
    held = case.model.hold(np.array([2]), np.array([value]))
    mean, precision = case.model.mean, case.model.precision
    others = np.array([0, 1, 3])
    given = np.linalg.solve(precision[np.ix_(others, others)], precision[others, 2] * (value - mean[2]))
    np.testing.assert_allclose(held.mean[others], mean[others] - given, atol=1e-4)
    assert held.mean[2] == pytest.approx(value, abs=1e-4)
    posterior = held.posterior(case.scales)
    assert posterior.mean[2] == pytest.approx(value, abs=1e-3)
    assert np.linalg.norm(posterior.spread[2]) < 1e-2


@given(SEEDS)
def test_to_hold_nothing_changes_nothing(seed: int) -> None:
    model = problem(seed).model
    held = model.hold(np.array([], dtype=np.intp), np.array([]))
    np.testing.assert_allclose(held.mean, model.mean, atol=1e-9)
    np.testing.assert_array_equal(held.precision, model.precision)
