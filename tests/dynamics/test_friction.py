"""Friction columns (7) to (9)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.dynamics.friction import (
    FRICTION_COLUMNS,
    friction_columns,
    friction_torque,
    smooth_sign,
    smooth_sign_slope,
)
from tauscope.errors import IdentificationError
from tauscope.robot.robot import FrictionCoefficients, FrictionShape

VELOCITY = np.array([-2.0, -0.3, -0.01, 0.0, 0.002, 0.1, 1.5])
SHAPE = FrictionShape(k_v=500.0, delta=10.0)
SLOPES = st.floats(0.1, 1e4)


def test_smooth_sign_is_half_at_the_inverse_slope_and_one_far_away() -> None:
    np.testing.assert_allclose(smooth_sign(np.array([-1 / 500, 0.0, 1 / 500]), 500.0), [-0.5, 0.0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(smooth_sign(np.array([-1e9, 1e9]), 500.0), [-1.0, 1.0], rtol=1e-11)


def test_columns_are_those_of_equation_9() -> None:
    columns = friction_columns(VELOCITY, SHAPE)
    assert columns.shape == (len(VELOCITY), len(FRICTION_COLUMNS))
    np.testing.assert_allclose(columns[:, 0], 2 / np.pi * np.arctan(500 * VELOCITY))
    np.testing.assert_allclose(columns[:, 1], 2 / np.pi * np.arctan(10 * VELOCITY))
    np.testing.assert_array_equal(columns[:, 2], VELOCITY)
    np.testing.assert_array_equal(columns[:, 3], 1.0)


def test_the_offset_can_be_left_out() -> None:
    np.testing.assert_array_equal(
        friction_columns(VELOCITY, SHAPE, offset=False), friction_columns(VELOCITY, SHAPE)[:, :3]
    )


def test_torque_where_the_arctangents_are_known() -> None:
    """At v = 0.1 both are those of an equilateral triangle and of a square: 2/3 and 1/2."""
    shape = FrictionShape(k_v=10 * np.sqrt(3), delta=10.0)
    torque = friction_torque(FrictionCoefficients(2.0, -0.3, 0.5), shape, np.array([0.1, -0.1, 0.0]))
    expected = 2.0 * 2 / 3 - 0.3 / 2 + 0.5 * 0.1
    np.testing.assert_allclose(torque, [expected, -expected, 0.0], rtol=1e-14)


@given(slope=SLOPES)
def test_slopes_are_those_of_the_columns(slope: float) -> None:
    """By complex steps, which have no rounding to hide behind."""
    step = 1e-30
    expected = (2 / np.pi * np.arctan(VELOCITY * (slope + 1j * step))).imag / step
    np.testing.assert_allclose(smooth_sign_slope(VELOCITY, slope), expected, rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize(
    ("shape", "missing"), [(FrictionShape(delta=10.0), "k_v"), (FrictionShape(k_v=500.0), "delta")]
)
def test_a_missing_shape_constant_is_named(shape: FrictionShape, missing: str) -> None:
    with pytest.raises(IdentificationError, match=missing):
        friction_columns(VELOCITY, shape)
