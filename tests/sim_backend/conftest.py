"""Arms for the tests of the simulated backend, made without the reader of robot files."""

from dataclasses import replace

import numpy as np
import pytest

from arms import paper_arm, paper_parameters
from tauscope.robot.robot import FrictionCoefficients, FrictionShape, JointLimits, LinkInertia, Model, Robot


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20210903)


@pytest.fixture
def paper() -> Robot:
    """The paper's arm as the packaged robot file describes it: links, friction, limits."""
    robot = paper_arm()
    limits = JointLimits(position=(-2.9, 2.9), velocity=2.0, acceleration=5.0, torque=40.0)
    shape = FrictionShape(k_v=500.0, delta=10.0)
    friction = (
        FrictionCoefficients(2.0, -0.3, 0.5),
        FrictionCoefficients(1.0, -0.2, 0.277),
        FrictionCoefficients(2.0, -0.3, 0.03),
    )
    links = tuple(LinkInertia.from_vector(vector) for vector in paper_parameters().reshape(3, 10))
    return replace(
        robot,
        joints=tuple(replace(joint, limits=limits, friction_shape=shape) for joint in robot.joints),
        model=Model(links=links, friction=friction),
    )
