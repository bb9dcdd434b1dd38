"""Torque that a position servo's supply and following error leave: closed forms, and the loop's own law."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from arms import arm, dh_segment
from tauscope.robot import Actuator, Robot
from tauscope.trajectory.servo_bounds import servo_bounds

SERVO = Actuator(
    "position", 32, unit="register", servo="feetech-sts3215", supply_voltage=7.4, torque_per_volt=0.25, back_emf=1.5
)
STALL, STIFFNESS, BACK_EMF = 0.97 * 7.4 * 0.25, 32 * 0.166 * 7.4 * 0.25, 1.5 * 0.25


def _arm(*loops: Actuator | None) -> Robot:
    robot = arm("servos", [dh_segment(0.0, 0.0, 0.1, 0.0) for _ in loops], (0.0, -9.81, 0.0))
    joints = (replace(joint, actuator=loop) for joint, loop in zip(robot.joints, loops, strict=True))
    return replace(robot, joints=tuple(joints))


def test_supply_less_back_emf_bounds_torque() -> None:
    bounds = servo_bounds(_arm(SERVO))
    assert bounds.names == ("voltage", "following error")
    assert bounds.available[0, 0] == pytest.approx(STALL)
    assert bounds.damping[0, 0] == pytest.approx(BACK_EMF)
    # at the bound the loop's own law is at its duty limit
    speed = 2.0
    assert SERVO.torque(10.0, speed) == pytest.approx(STALL - BACK_EMF * speed)
    assert bounds.share(np.array([[STALL - BACK_EMF * speed]]), np.array([[speed]]))[0, 0, 0] == pytest.approx(1.0)


@pytest.mark.parametrize("delay", [None, 0.05])
def test_following_error_is_torque_and_damping_by_stiffness_and_speed_by_lag(delay: float | None) -> None:
    bounds = servo_bounds(_arm(replace(SERVO, delay=delay)), 0.15, 50.0)
    torque, speed = 0.3, 0.4
    lag_s = (0.04 if delay is None else delay) + 0.02  # two cycles of pace, one until it is read
    error = (torque + BACK_EMF * speed) / STIFFNESS + speed * lag_s
    share = bounds.share(np.array([[torque]]), np.array([[speed]]))[0, 1, 0]
    assert share == pytest.approx(error / 0.15)
    # the loop's own law: the error that gives this torque at this speed
    assert SERVO.torque((torque + BACK_EMF * speed) / STIFFNESS, speed) == pytest.approx(torque)


def test_no_torque_is_left_at_the_no_load_speed() -> None:
    fast = replace(SERVO, delay=0.0)
    bounds = servo_bounds(_arm(fast, None), 0.2, 1e9)
    assert bounds.speed[0] == pytest.approx(min(STALL, 0.2 * STIFFNESS) / BACK_EMF)
    assert np.isinf(bounds.speed[1])


def test_only_a_supply_below_the_stated_one_counts() -> None:
    robot = _arm(SERVO, SERVO, SERVO, replace(SERVO, supply_voltage=None))
    found = servo_bounds(robot, voltage=np.array([5.0, 9.0, np.nan, 6.0])).available
    np.testing.assert_allclose(found[0], STALL / 7.4 * np.array([5.0, 7.4, 7.4, 6.0]))
    np.testing.assert_allclose(found[1], 0.2 * STIFFNESS / 7.4 * np.array([5.0, 7.4, 7.4, 6.0]))
    assert (servo_bounds(robot, voltage=np.zeros(4)).available == 0.0).all()


def test_a_loop_in_si_has_no_duty_limit_and_its_damping_makes_it_lag() -> None:
    bounds = servo_bounds(_arm(Actuator("position", 60.0, kd=2.0, delay=0.0)), 0.1, 1e9)
    assert bounds.names == ("following error",)
    assert bounds.available[0, 0] == pytest.approx(6.0)
    assert bounds.damping[0, 0] == pytest.approx(2.0)


@pytest.mark.parametrize(
    "loop",
    [
        None,
        Actuator("torque"),
        replace(SERVO, servo="dynamixel-x", torque_per_volt=None),
        replace(SERVO, supply_voltage=None),
    ],
    ids=["none", "torque", "no torque per volt", "no supply"],
)
def test_what_is_not_stated_bounds_nothing(loop: Actuator | None) -> None:
    assert servo_bounds(_arm(loop)).names == ()


def test_gains_of_an_mjcf_are_the_simulation_s() -> None:
    robot = replace(_arm(Actuator("position", 60.0), SERVO), mjcf=Path("arm.xml"))
    bounds = servo_bounds(robot)
    assert np.isinf(bounds.available[:, 0]).all()
    assert np.isfinite(bounds.available[:, 1]).all()
