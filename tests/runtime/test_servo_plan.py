"""A motion that a position servo cannot follow is refused before it moves; joint, bound and remedy are named."""

from dataclasses import replace

import numpy as np
import pytest

from runtime.doubles import PointArm, point_robot, short_motion
from tauscope.errors import AcquisitionError
from tauscope.robot import Actuator, Model
from tauscope.runtime.options import RunOptions
from tauscope.runtime.plan import Plan, _require_followed, make_plan
from tauscope.trajectory.servo_bounds import servo_bounds
from tauscope_drivers import ControlMode

STRONG = Actuator(
    "position", 1600, unit="register", servo="dynamixel-x", supply_voltage=12.0, torque_per_volt=4.0, back_emf=0.5
)


def plan(
    loop: Actuator, *, feeds: bool = False, voltage: float | None = None, models: bool = True, **options: object
) -> Plan:
    """The plan of a motion whose second joint has this servo."""
    robot = point_robot()
    joints = (robot.joints[0], replace(robot.joints[1], actuator=loop))
    robot = replace(robot, joints=joints, model=robot.model if models else Model())
    motion = short_motion(robot)
    capabilities = replace(PointArm().capabilities, takes_feed_forward=feeds)
    measured = None if voltage is None else np.array([np.nan, voltage])
    return make_plan(robot, motion, motion.start, RunOptions.model_validate(options), capabilities, measured)


def refusal(loop: Actuator, **options: object) -> str:
    with pytest.raises(AcquisitionError) as caught:
        plan(loop, **options)  # pyright: ignore[reportArgumentType]
    return str(caught.value)


def test_a_servo_that_is_strong_enough_is_planned_for() -> None:
    assert plan(STRONG).cycles > 0
    assert plan(STRONG, voltage=np.nan).cycles > 0


def test_too_low_a_supply_is_refused_as_stated_and_as_measured() -> None:
    weak = refusal(replace(STRONG, supply_voltage=0.2))
    assert weak.startswith("joint2: ")
    assert "its voltage leaves" in weak
    assert "raise the supply" in weak
    assert "its voltage leaves" in refusal(STRONG, voltage=0.2)
    assert "its voltage leaves 0 Nm" in refusal(STRONG, voltage=0.0)


def test_back_emf_is_refused_without_a_model_too() -> None:
    assert "its voltage leaves 0 Nm" in refusal(replace(STRONG, back_emf=1e3), models=False)


def test_a_soft_loop_is_refused_unless_it_is_allowed_to_lag() -> None:
    soft = replace(STRONG, kp=40, delay=0.0)
    refused = refusal(soft, following_error=0.01)
    assert refused.startswith("joint2: ")
    assert "its following error leaves" in refused
    assert "allow a larger following_error" in refused
    assert plan(soft, following_error=3.0).cycles > 0


def test_a_servo_that_gets_the_torque_need_not_lag_for_it() -> None:
    soft = replace(STRONG, kp=40, delay=0.0)
    assert plan(soft, feeds=True, following_error=0.01).cycles > 0
    assert plan(soft, mode=ControlMode.TORQUE, following_error=0.01).cycles > 0
    assert "its voltage leaves" in refusal(replace(soft, supply_voltage=0.2), feeds=True)


def test_torque_that_is_no_number_is_refused() -> None:
    robot = point_robot()
    bounds = servo_bounds(replace(robot, joints=tuple(replace(joint, actuator=STRONG) for joint in robot.joints)))
    torque = np.zeros((5, 2))
    torque[3, 1] = np.nan
    with pytest.raises(AcquisitionError, match=r"joint2: .* needs nan Nm"):
        _require_followed(robot, bounds, torque, np.zeros((5, 2)), 10.0, droops=True)
