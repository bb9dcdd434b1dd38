"""Which orders of a periodic torque are looked for."""

from dataclasses import replace

import numpy as np
import pytest

from effects.piece_of_motion import context
from tauscope.effects.periodic_torque import FARTHER, farther_orders, possible_orders, waves

CYCLES = 2.0 * np.pi


@pytest.mark.parametrize("cycles", [2.0, 3.5, 9.0])
def test_a_wave_that_fits_into_the_range_a_few_times_is_looked_for(cycles: float) -> None:
    """A maximum of the angle-periodogram is two cycles over the range wide: no order may lie a half from all."""
    given = context()
    joint = 1
    order = cycles * CYCLES / float(given.highest[joint] - given.lowest[joint])
    distance = np.abs(possible_orders(given, joint) - order).min() * (given.highest[joint] - given.lowest[joint])
    assert distance < 0.5 * CYCLES


def test_a_wave_as_long_as_the_range_is_a_spring_by_another_name() -> None:
    given = context()
    reach = given.highest - given.lowest
    for joint in given.joints:
        assert possible_orders(given, joint).min() * reach[joint] > CYCLES


def test_a_joint_that_stands_has_none() -> None:
    given = context()
    still = replace(given, highest=given.lowest.copy())
    assert not len(possible_orders(still, 0))


def test_farther_orders_go_on_where_the_others_end() -> None:
    given = context()
    for joint in given.joints:
        near, farther = possible_orders(given, joint), farther_orders(given, joint)
        step = near[1] - near[0]
        assert farther[0] - near[-1] == pytest.approx(step)
        assert np.diff(farther) == pytest.approx(np.full(len(farther) - 1, step))
        assert farther[-1] > 2.0 * near[-1]
        assert farther[-1] < 1.01 * FARTHER * near[-1] + step


def test_a_geared_motor_s_orders_are_its_multiples_however_far() -> None:
    """100 to 1 at a speed that carries the first order beyond the band: nothing near, and multiples of 100 farther."""
    given = context()
    joints = [replace(joint, gear_ratio=100.0) for joint in given.robot.joints]
    geared = replace(given, robot=replace(given.robot, joints=tuple(joints)), speed=np.ones_like(given.speed))
    geared = replace(geared, cutoff_hz=100.0 / (2.0 * np.pi))
    assert not len(possible_orders(geared, 0))
    farther = farther_orders(geared, 0)
    assert len(farther) >= 4
    assert farther == pytest.approx(100.0 * np.arange(1, len(farther) + 1))


@pytest.mark.parametrize("orders", [np.linspace(2.0, 300.0, 800), np.array([7.0, 14.0, 28.0, 36.0]), np.array([3.0])])
def test_waves_of_even_steps_are_those_of_any(orders: np.ndarray) -> None:
    position = np.linspace(-6.0, 6.0, 500)
    angle = orders[:, None] * position
    np.testing.assert_allclose(waves(position, orders), np.stack([np.sin(angle), np.cos(angle)], axis=1), atol=1e-11)
