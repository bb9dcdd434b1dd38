"""The straight line through a parameter's values, against NumPy's own fit and against what was put in."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from tauscope.server.history.drift import TrendPoint, fit_trend

START = datetime(2026, 1, 1, tzinfo=UTC)


def points(weeks: np.ndarray, values: np.ndarray, stds: np.ndarray) -> list[TrendPoint]:
    rows = zip(weeks.tolist(), values.tolist(), stds.tolist(), strict=True)
    return [TrendPoint(START + timedelta(weeks=week), value, std) for week, value, std in rows]


def test_the_same_line_as_numpys() -> None:
    rng = np.random.default_rng(0)
    weeks, std = np.sort(rng.uniform(0, 30, 12)), rng.uniform(0.01, 0.1, 12)
    values = 0.5 + 0.02 * weeks + 5 * std * rng.standard_normal(12)
    (slope, _), covariance = np.polyfit(weeks, values, 1, w=1 / std, cov=True)
    trend = fit_trend(points(weeks, values, std))
    assert trend is not None
    assert (
        trend.scatter > 1
    )  # the points scatter more than their errors say: the error grows with them, as numpy's does
    assert trend.slope == pytest.approx(slope)
    assert trend.slope_std == pytest.approx(np.sqrt(covariance[0, 0]))
    assert trend.change == pytest.approx(slope * np.ptp(weeks))


def test_points_on_a_line_have_the_errors_that_they_state() -> None:
    weeks, std = np.arange(5.0), np.full(5, 0.1)
    trend = fit_trend(points(weeks, 1 - 0.3 * weeks, std))
    assert trend is not None
    assert (trend.count, trend.slope) == (5, pytest.approx(-0.3))
    assert trend.scatter == pytest.approx(0.0, abs=1e-9)
    assert trend.slope_std == pytest.approx(0.1 / np.sqrt(10.0))  # σ/√Σ(t - t̄)²
    assert trend.in_std == pytest.approx(-0.3 / (0.1 / np.sqrt(10.0)))


def test_the_error_covers_the_truth_as_often_as_it_says() -> None:
    rng, weeks, std = np.random.default_rng(1), np.arange(20.0), np.full(20, 0.1)
    slopes = []
    for _ in range(400):
        trend = fit_trend(points(weeks, 0.1 * weeks + 0.1 * rng.standard_normal(20), std))
        assert trend is not None
        slopes.append((trend.slope - 0.1) / trend.slope_std)
    assert np.mean(np.abs(slopes) < 1.96) > 0.93


@pytest.mark.parametrize("weeks", [[], [1.0], [1.0, 2.0], [3.0, 3.0, 3.0]])
def test_no_slope_where_nothing_tells_one(weeks: list[float]) -> None:
    assert fit_trend(points(np.array(weeks), np.ones(len(weeks)), np.ones(len(weeks)))) is None
