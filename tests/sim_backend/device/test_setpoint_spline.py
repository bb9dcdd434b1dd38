"""Targets between setpoints: no ripple, no overshoot, and none of the host's jitter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_sim.device.target import SetpointSpline


def feed(spline: SetpointSpline, function, arrivals, ticks):
    """Targets at ticks, with setpoints added as they arrive: pairs of arrival and the instant they are meant for."""
    waiting = list(arrivals)
    targets = []
    for tick in ticks:
        while waiting and waiting[0][0] <= tick:
            arrival, meant = waiting.pop(0)
            spline.add(np.array([function(meant)]), arrival)
        targets.append(np.concatenate(spline.at(tick)))
    return np.array(targets)


def test_a_cubic_is_reproduced_two_cycles_late() -> None:
    period = 4.0
    cubic = np.polynomial.Polynomial([0.3, 0.02, -3e-4, 2e-6])
    arrivals = [(period * k, period * k) for k in range(40)]
    ticks = np.arange(60, 150)
    targets = feed(SetpointSpline(np.array([0.3])), cubic, arrivals, range(150))[60:]
    late = ticks - 2.0 * period
    # the B-spline filter adds T²/6 of the second derivative: the same at every tick, so no ripple
    smoothed = cubic + (period**2 / 6.0) * cubic.deriv(2)
    np.testing.assert_allclose(targets[:, 0], smoothed(late), atol=1e-12)
    np.testing.assert_allclose(targets[:, 1], smoothed.deriv(1)(late), atol=1e-12)


@given(st.lists(st.floats(-2.0, 2.0), min_size=5, max_size=30), st.sampled_from([1.0, 3.5, 4.0, 20.0]))
def test_the_target_stays_in_the_hull_of_the_setpoints(values: list[float], period: float) -> None:
    spline = SetpointSpline(np.array([values[0]]))
    arrivals = [(period * k, k) for k in range(len(values))]
    last = int(period * (len(values) - 1))
    targets = feed(spline, lambda k: values[k], arrivals, range(last + 1))
    assert np.all(targets[:, 0] >= min(values) - 1e-9)
    assert np.all(targets[:, 0] <= max(values) + 1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_jitter_of_the_host_does_not_reach_the_target(seed: int) -> None:
    rng = np.random.default_rng(seed)
    period, omega = 4.0, 2e-3
    arrivals = [(period * k + rng.exponential(0.2), period * k) for k in range(1000)]
    targets = feed(SetpointSpline(np.zeros(1)), lambda t: np.sin(omega * t), arrivals, range(3990))[400:]
    ticks = np.arange(400, 3990)
    # compared with the best smooth curve of that frequency: what is left is jitter
    basis = np.stack([np.sin(omega * ticks), np.cos(omega * ticks), np.ones(len(ticks))], axis=1)
    fit, *_ = np.linalg.lstsq(basis, targets[:, 1], rcond=None)
    residual = targets[:, 1] - basis @ fit
    assert residual.std() < 1e-3 * omega
    # a chord between setpoints alone would make the velocity step by ω² T at each of them
    assert residual.std() < 0.2 * omega**2 * period


def test_skipped_cycles_are_filled_in() -> None:
    period, omega = 4.0, 2e-3
    kept = [k for k in range(300) if k % 50 not in (20, 21)]
    arrivals = [(period * k, period * k) for k in kept]
    targets = feed(SetpointSpline(np.zeros(1)), lambda t: np.sin(omega * t), arrivals, range(1190))[100:]
    late = np.arange(100, 1190) - 2.0 * period
    np.testing.assert_allclose(targets[:, 0], np.sin(omega * late), atol=3e-4)
    np.testing.assert_allclose(targets[:, 1], omega * np.cos(omega * late), atol=0.03 * omega)


def test_a_change_of_pace_is_found_out() -> None:
    omega = 2e-3
    instants = [*(4.0 * k for k in range(100)), *(400.0 + 10.0 * k for k in range(100))]
    targets = feed(SetpointSpline(np.zeros(1)), lambda t: np.sin(omega * t), [(t, t) for t in instants], range(1390))
    ticks = np.arange(1000, 1390)
    np.testing.assert_allclose(targets[1000:, 0], np.sin(omega * (ticks - 20.0)), atol=1e-4)


def test_it_starves_five_cycles_after_the_last_setpoint() -> None:
    spline = SetpointSpline(np.zeros(1))
    feed(spline, float, [(4.0 * k, 0.0) for k in range(50)], range(197))
    assert not spline.is_starved(196.0 + 4.9 * 4.0)
    assert spline.is_starved(196.0 + 5.1 * 4.0)


def test_a_period_that_was_told_is_kept_from_the_first_setpoint_on() -> None:
    period, slope = 7.0, 0.01
    arrivals = [(period * k, period * k) for k in range(60)]
    targets = feed(SetpointSpline(np.zeros(1), period), lambda t: slope * t, arrivals, range(400))[35:]
    np.testing.assert_allclose(targets[:, 0], slope * (np.arange(35, 400) - 2.0 * period), atol=1e-12)
    np.testing.assert_allclose(targets[:, 1], slope, atol=1e-12)


@pytest.mark.parametrize("late", [0.3, 0.6, 0.85])
def test_a_late_setpoint_of_a_told_period_is_the_next_and_none_after_a_gap(late: float) -> None:
    period, slope = 4.0, 0.01
    arrivals = [(period * (k + (late if k == 40 else 0.0)), period * k) for k in range(80)]
    targets = feed(SetpointSpline(np.zeros(1), period), lambda t: slope * t, arrivals, range(316))[60:]
    np.testing.assert_allclose(targets[:, 1], slope, rtol=0.02)


@pytest.mark.parametrize("told", [5.0, None])
def test_late_setpoints_at_first_do_not_throw_the_grid_off_for_long(told: float | None) -> None:
    """A slope found from them would run away from those that follow, until a setpoint falls between two cycles."""
    period, slope = 5.0, 0.01
    late = [0.12 * k if 3 <= k < 20 else 0.0 for k in range(800)]
    arrivals = [(period * k + late[k], period * k) for k in range(800)]
    targets = feed(SetpointSpline(np.zeros(1), told), lambda t: slope * t, arrivals, range(3990))[400:]
    np.testing.assert_allclose(targets[:, 1], slope, rtol=0.05)


def test_a_grid_that_setpoints_are_off_for_good_is_begun_anew() -> None:
    period, slope = 5.0, 0.01
    arrivals = [(period * k + (1.5 if k >= 100 else 0.0), period * k) for k in range(400)]
    targets = feed(SetpointSpline(np.zeros(1), period), lambda t: slope * t, arrivals, range(1990))[700:]
    np.testing.assert_allclose(targets[:, 0], slope * (np.arange(700, 1990) - 1.5 - 2.0 * period), atol=1e-3 * slope)
