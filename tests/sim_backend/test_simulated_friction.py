"""The friction curve: known values, symmetry, and complaints about what is missing."""

import numpy as np
import pytest

from tauscope.errors import RobotFileError
from tauscope.robot.robot import FrictionCoefficients, FrictionShape
from tauscope_sim.friction import static_friction_torque

SHAPE = FrictionShape(k_v=500.0, delta=10.0)


def curve(velocity: float, coefficients: FrictionCoefficients, shape: FrictionShape = SHAPE) -> float:
    return float(static_friction_torque(np.array([[velocity]]), [coefficients], [shape])[0, 0])


def test_each_term_at_a_velocity_where_it_is_known() -> None:
    # arctan(1) is half of π/2
    assert curve(1 / 500, FrictionCoefficients(stiction=2.0)) == pytest.approx(1.0, rel=1e-12)
    assert curve(1 / 10, FrictionCoefficients(stribeck=-0.3)) == pytest.approx(-0.15, rel=1e-12)
    assert curve(0.7, FrictionCoefficients(viscous=0.5)) == pytest.approx(0.35, rel=1e-12)


def test_fast_motion_leaves_coulomb_and_viscous_friction() -> None:
    coefficients = FrictionCoefficients(stiction=2.0, stribeck=-0.3, viscous=0.5)
    assert curve(1e6, coefficients) == pytest.approx(1.7 + 0.5e6, abs=1e-6)


def test_friction_opposes_motion_and_is_odd(rng: np.random.Generator) -> None:
    velocity = rng.normal(size=(200, 1))
    coefficients = FrictionCoefficients(stiction=2.0, stribeck=-0.3, viscous=0.5)
    torque = static_friction_torque(velocity, [coefficients], [SHAPE])
    assert np.all(torque * velocity > 0.0)
    np.testing.assert_array_equal(static_friction_torque(-velocity, [coefficients], [SHAPE]), -torque)


def test_friction_rises_then_falls_past_the_stribeck_velocity() -> None:
    coefficients = FrictionCoefficients(stiction=2.0, stribeck=-0.3)
    assert curve(0.02, coefficients) > curve(0.002, coefficients)
    assert curve(0.02, coefficients) > curve(1.0, coefficients)


def test_joints_do_not_mix(rng: np.random.Generator) -> None:
    velocity = rng.normal(size=(10, 2))
    friction = [FrictionCoefficients(viscous=1.0), FrictionCoefficients(stiction=1.0)]
    torque = static_friction_torque(velocity, friction, [FrictionShape(), SHAPE])
    np.testing.assert_array_equal(torque[:, 0], velocity[:, 0])
    np.testing.assert_array_equal(torque[:, 1:], static_friction_torque(velocity[:, 1:], friction[1:], [SHAPE]))


@pytest.mark.parametrize(
    ("coefficients", "missing"),
    [(FrictionCoefficients(stiction=1.0), "k_v"), (FrictionCoefficients(stribeck=-0.1), "delta")],
)
def test_missing_shape_is_named(coefficients: FrictionCoefficients, missing: str) -> None:
    with pytest.raises(RobotFileError, match=f"joint 1: friction_shape.{missing} is missing"):
        curve(1.0, coefficients, FrictionShape())


def test_number_of_entries_must_be_the_number_of_joints() -> None:
    with pytest.raises(RobotFileError, match="friction has 1 and friction_shape 1 entries; the arm has 2 joints"):
        static_friction_torque(np.zeros((1, 2)), [FrictionCoefficients()], [SHAPE])
