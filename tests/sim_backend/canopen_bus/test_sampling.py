"""Emulated drives sample when SYNC comes, between two steps of the physics too."""

import numpy as np
import pytest

from arm_rigs import START, bench_robot
from tauscope_sim.canopen_bus.drive import AxisScale, EmulatedDrive
from tauscope_sim.canopen_bus.driven_arm import DrivenArm
from tauscope_sim.emulation.emulator import STEP_S
from tauscope_sim.scenario import Scenario

COUNTS_PER_RADIAN = 1e7
POSITION, VELOCITY = 0x6064, 0x606C


@pytest.fixture
def falling() -> tuple[DrivenArm, list[EmulatedDrive]]:
    """An arm that nobody holds, some 50 ms after it was let go of."""
    drives = [EmulatedDrive(node, AxisScale(COUNTS_PER_RADIAN, 400, 50.0)) for node in (1, 2, 3)]
    driven = DrivenArm(drives, bench_robot(), Scenario(), tuple(START.tolist()), STEP_S, 0.0)
    driven.stands_on_stand = False
    for tick in range(1, 51):
        driven.step(tick)
        driven.stands_on_stand = False
    return driven, drives


def told(drives: list[EmulatedDrive], index: int) -> np.ndarray:
    return np.array([drive.dictionary.get(index) for drive in drives]) / COUNTS_PER_RADIAN


def test_what_is_seen_between_two_steps_goes_on_to_what_the_next_shows(
    falling: tuple[DrivenArm, list[EmulatedDrive]],
) -> None:
    driven, drives = falling
    driven.measure(0.0)
    at_tick, speed = told(drives, POSITION), told(drives, VELOCITY)
    assert np.abs(speed).max() > 0.1, "it falls"
    driven.measure(0.5)
    between = told(drives, POSITION)
    driven.measure(1.0)
    ahead = told(drives, POSITION)
    driven.step(51)
    driven.measure(0.0)
    np.testing.assert_allclose(ahead, told(drives, POSITION), atol=2e-5)
    np.testing.assert_allclose(between, 0.5 * (at_tick + ahead), atol=2.0 / COUNTS_PER_RADIAN)
    np.testing.assert_allclose(ahead - at_tick, speed * STEP_S, atol=2e-5)
