"""Which orders of a periodic torque are looked for."""

from dataclasses import replace

import numpy as np
import pytest

from effects.piece_of_motion import context
from tauscope.effects.periodic_torque import possible_orders, waves

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


def test_a_geared_motor_s_orders_are_its_multiples() -> None:
    given = context()
    joints = [replace(joint, gear_ratio=100.0) for joint in given.robot.joints]
    geared = replace(given, robot=replace(given.robot, joints=tuple(joints)), speed=np.ones_like(given.speed))
    orders = possible_orders(replace(geared, cutoff_hz=500.0 / CYCLES / 0.8), 0)
    assert orders == pytest.approx(100.0 * np.arange(1, len(orders) + 1))
    assert len(orders) in (4, 5)


@pytest.mark.parametrize("orders", [np.linspace(2.0, 300.0, 800), np.array([7.0, 14.0, 28.0, 36.0]), np.array([3.0])])
def test_waves_of_even_steps_are_those_of_any(orders: np.ndarray) -> None:
    position = np.linspace(-6.0, 6.0, 500)
    angle = orders[:, None] * position
    np.testing.assert_allclose(waves(position, orders), np.stack([np.sin(angle), np.cos(angle)], axis=1), atol=1e-11)
