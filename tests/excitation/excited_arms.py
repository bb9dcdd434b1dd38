"""Arms with limits and models, and motions for them."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from arms import panda_like, paper_arm, paper_parameters, random_arm, random_link, ur5_like
from tauscope.dynamics import inverse_dynamics
from tauscope.excitation import ExcitationDesign, ExcitationOptions, optimiser
from tauscope.robot import FrictionCoefficients, FrictionShape, Joint, JointLimits, LinkInertia, Model, Robot
from tauscope.trajectory import FourierSeries, motion_limits

Array = NDArray[np.float64]


PAPER_SHAPE = FrictionShape(500.0, 10.0)


@contextmanager
def short_search() -> Iterator[None]:
    """Designs that are nowhere near the best: a few iterations show whether limits are kept."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("CANDIDATES", 24), ("SHORT_ROUND", 12), ("LONG_ROUND", 12)):
            patch.setattr(optimiser, name, value)
        yield


def with_limits(robot: Robot, limits: JointLimits, shape: FrictionShape = PAPER_SHAPE) -> Robot:
    """The arm, every joint with these limits."""
    joints = tuple(Joint(j.name, j.type, limits, friction_shape=shape) for j in robot.joints)
    return replace(robot, joints=joints)


def limited_paper_arm(torque: float | None = 40.0) -> Robot:
    """The paper's arm with the limits and the model of the example robot file."""
    robot = with_limits(paper_arm(), JointLimits((-2.9, 2.9), 2.0, 5.0, torque))
    links = tuple(LinkInertia.from_vector(vector) for vector in paper_parameters().reshape(-1, 10))
    friction = (
        FrictionCoefficients(2.0, -0.3, 0.5),
        FrictionCoefficients(1.0, -0.2, 0.277),
        FrictionCoefficients(2.0, -0.3, 0.03),
    )
    return replace(robot, model=Model(links, friction))


def modelled_arm(rng: np.random.Generator, joint_count: int) -> Robot:
    """A random chain, prismatic joints included, with links, friction and limits."""
    robot = with_limits(random_arm(rng, joint_count), JointLimits((-1.5, 1.2), 1.5, 6.0, 200.0))
    links = tuple(random_link(rng) for _ in range(joint_count))
    friction = tuple(FrictionCoefficients(*rng.uniform(0.0, 1.0, 3)) for _ in range(joint_count))
    return replace(robot, model=Model(links, friction))


def gradient_arms() -> list[Robot]:
    """Arms on which gradients are checked: the paper's, UR5-like, Panda-like, random ones with prismatic joints."""
    slow = FrictionShape(20.0, 3.0)
    named = [with_limits(arm(), JointLimits((-2.5, 2.5), 2.0, 6.0, 50.0), slow) for arm in (paper_arm, ur5_like)]
    panda = with_limits(panda_like(), JointLimits((-2.5, 2.5), 2.0, 6.0, 50.0), FrictionShape(20.0))
    links = [tuple(random_link(np.random.default_rng(j)) for j in range(r.joint_count)) for r in (*named, panda)]
    modelled = [replace(r, model=Model(each)) for r, each in zip((*named, panda), links, strict=True)]
    return [*modelled, modelled_arm(np.random.default_rng(1), 3), modelled_arm(np.random.default_rng(2), 4)]


def resting_series(
    rng: np.random.Generator, joint_count: int, harmonics: int = 5, period_s: float = 10.0
) -> FourierSeries:
    """A random series at rest at the ends of its period, speeds of about one."""
    order = np.arange(1.0, harmonics + 1.0)
    cosine = rng.normal(scale=0.3, size=(joint_count, harmonics))
    cosine -= cosine.mean(axis=1, keepdims=True)
    sine = rng.normal(scale=0.3, size=(joint_count, harmonics))
    sine -= np.multiply.outer(sine @ order, order) / (order @ order)
    return FourierSeries(period_s, rng.uniform(-0.5, 0.5, joint_count), cosine, sine)


def derivative_along(function: Callable[[Array], float], x: Array, direction: Array, step: float) -> float:
    """Sixth-order central difference along a direction."""
    weights = {1: 45.0 / 60.0, 2: -9.0 / 60.0, 3: 1.0 / 60.0}
    pairs = (w * (function(x + k * step * direction) - function(x - k * step * direction)) for k, w in weights.items())
    return float(sum(pairs)) / step


def assert_within_limits(robot: Robot, design: ExcitationDesign, options: ExcitationOptions) -> None:
    """All limits, ten times finer than anything that the design looked at, torque by a calculation of its own."""
    samples = design.trajectory.samples(4000.0 / min(options.period_s, 10.0))
    limits = motion_limits(robot)
    assert (samples.position >= limits.position_low - 1e-9).all()
    assert (samples.position <= limits.position_high + 1e-9).all()
    assert (np.abs(samples.velocity) <= limits.velocity * (1.0 + 1e-9)).all()
    assert (np.abs(samples.acceleration) <= limits.acceleration * (1.0 + 1e-9)).all()
    if robot.model.links is not None:
        parameters = np.concatenate([link.to_vector() for link in robot.model.links])
        torque = inverse_dynamics(robot, parameters, samples.position, samples.velocity, samples.acceleration)
        assert (np.abs(torque) <= (1.0 - options.torque_margin) * limits.torque).all()


def rest_error(series: FourierSeries) -> tuple[float, float]:
    """Largest speed and acceleration at the ends of a period: |Σ a_l| and ω_f |Σ l b_l| [rad/s, rad/s²]."""
    speed, acceleration = np.abs(series.cosine.sum(axis=1)), np.abs(series.sine @ series.frequencies)
    return float(speed.max(initial=0.0)), float(acceleration.max(initial=0.0))
