"""Limits that a driver keeps for its drives."""

from dataclasses import replace

import numpy as np
import pytest

from tauscope_drivers import DriveLimits, DriverError, Setpoint
from tauscope_drivers.limits import require_finite, require_sensible

LOW, HIGH, SPEED, TORQUE = -1.0, 1.5, 0.8, 20.0
BOUNDS = DriveLimits(*(np.full(2, value) for value in (LOW, HIGH, SPEED, TORQUE)))
CYCLE_NS = 5_000_000
LABELS = ("shoulder (node 1)", "elbow (node 2)")


def setpoint(position: float, torque: float = 0.0) -> Setpoint:
    return Setpoint(np.full(2, position), np.full(2, torque))


def test_an_arm_outside_its_range_is_not_enabled() -> None:
    with pytest.raises(DriverError, match=r"elbow \(node 2\) stands at 1\.7, outside its limits -1 to 1\.5; move it"):
        require_sensible(BOUNDS, np.array([0.0, 1.7]), LABELS)
    require_sensible(BOUNDS, np.array([0.0, 1.54]), LABELS)


@pytest.mark.parametrize(
    ("name", "value"),
    [("position_low", HIGH), ("position_high", np.nan), ("velocity", 0.0), ("torque", np.nan), ("torque", -1.0)],
)
def test_limits_that_leave_no_motion_are_refused(name: str, value: float) -> None:
    senseless = replace(BOUNDS, **{name: np.array([getattr(BOUNDS, name)[0], value])})
    with pytest.raises(DriverError, match=r"elbow \(node 2\): .* no motion; correct them"):
        require_sensible(senseless, np.zeros(2), LABELS)


def test_limits_of_too_few_joints_are_refused() -> None:
    with pytest.raises(DriverError, match=r"limits\.torque is not one number for each of 2 joints"):
        require_sensible(replace(BOUNDS, torque=np.ones(1)), np.zeros(2), LABELS)


@pytest.mark.parametrize(
    "faulty",
    [
        Setpoint(np.array([0.0, np.nan]), np.zeros(2)),
        Setpoint(np.zeros(2), np.array([np.inf, 0.0])),
        Setpoint(np.zeros(1), np.zeros(2)),
    ],
    ids=["not a number", "infinite", "missing"],
)
def test_a_target_that_is_no_number_is_refused(faulty: Setpoint) -> None:
    require_finite(setpoint(0.3), 2)
    with pytest.raises(DriverError, match="nothing was sent"):
        require_finite(faulty, 2)
