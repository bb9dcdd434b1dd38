"""Arms with links, friction and limits for the tests of the simulated drives."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from arm_rigs import bench_robot
from arms import panda_like, random_link, ur5_like
from tauscope.robot.robot import FrictionCoefficients, FrictionShape, JointLimits, Model, Robot

_TORQUE = (150.0, 150.0, 100.0, 40.0, 30.0, 20.0, 15.0)


def with_links(robot: Robot) -> Robot:
    """Links of a few kilograms, lighter towards the hand, and friction that falls likewise."""
    rng = np.random.default_rng(3)
    scales = [1.0 if j < 3 else 0.3 for j in range(robot.joint_count)]
    links = tuple(type(link).from_vector(link.to_vector() * k) for k in scales for link in (random_link(rng),))
    friction = tuple(FrictionCoefficients(2.0 / (1.0 + 0.5 * j), -0.3, 0.5 / (1.0 + j)) for j in range(len(links)))
    joints = tuple(
        replace(joint, limits=JointLimits((-2.9, 2.9), 2.0, 5.0, torque), friction_shape=FrictionShape(500.0, 10.0))
        for joint, torque in zip(robot.joints, _TORQUE, strict=False)
    )
    return replace(robot, joints=joints, model=Model(links, friction))


ARMS: dict[str, Callable[[], Robot]] = {
    "paper": bench_robot,
    "six joints": lambda: with_links(ur5_like()),
    "seven joints": lambda: with_links(panda_like()),
}


@pytest.fixture(params=list(ARMS))
def arm_name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def robot(arm_name: str) -> Robot:
    return ARMS[arm_name]()
