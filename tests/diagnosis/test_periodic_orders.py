"""Which orders of a periodic torque are looked for."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.test_effect_columns import setting
from service.diagnosis.catalogue.periodic_torque import possible_orders

CYCLES = 2.0 * np.pi


@pytest.mark.parametrize("cycles", [2.0, 3.5, 9.0])
def test_a_wave_that_fits_into_the_range_a_few_times_is_looked_for(cycles: float) -> None:
    """A maximum of the angle-periodogram is two cycles over the range wide: no order may lie a half from all."""
    given = setting()
    joint = 1
    order = cycles * CYCLES / float(given.highest[joint] - given.lowest[joint])
    distance = np.abs(possible_orders(given, joint) - order).min() * (given.highest[joint] - given.lowest[joint])
    assert distance < 0.5 * CYCLES


def test_a_wave_as_long_as_the_range_is_a_spring_by_another_name() -> None:
    given = setting()
    reach = given.highest - given.lowest
    for joint in given.joints:
        assert possible_orders(given, joint).min() * reach[joint] > CYCLES


def test_a_joint_that_stands_has_none() -> None:
    given = setting()
    still = replace(given, highest=given.lowest.copy())
    assert not len(possible_orders(still, 0))
