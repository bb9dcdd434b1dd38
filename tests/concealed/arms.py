"""The arms on which effects are concealed: three, six and seven axes, with links, friction and limits of their own."""

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from arms import dh_segment, mdh_segment
from service.robot import (
    FrictionCoefficients,
    FrictionShape,
    Joint,
    JointLimits,
    LinkInertia,
    Model,
    Robot,
    Segment,
    read_robot,
)
from sim_backend.examples import example_robot

Array = NDArray[np.float64]

NOISE_STD: dict[str, tuple[float, ...]] = {
    "paper": (0.5, 0.3, 0.7),
    "six": (1.2, 1.5, 1.0, 0.4, 0.3, 0.2),
    "seven": (0.8, 1.2, 0.8, 0.8, 0.3, 0.25, 0.2),
}
"""Standard deviation of the torque's noise at 200 Hz [Nm]."""


@cache
def arm_named(name: str) -> Robot:
    """One of the arms, the truth in its model block."""
    return {"paper": _paper, "six": _six, "seven": _seven}[name]()


def without_truth(robot: Robot, *, states_friction: bool) -> Robot:
    """The robot file that the diagnosis gets: no model, and perhaps not even the constants of the friction's curve."""
    joints = robot.joints
    if not states_friction:
        joints = tuple(replace(joint, friction_shape=FrictionShape(None, None)) for joint in joints)
    return replace(robot, joints=joints, model=Model(None, None))


def _paper() -> Robot:
    return read_robot(example_robot("paper_arm"))


def _six() -> Robot:
    """An industrial arm of 1 m reach and 30 kg."""
    half = np.pi / 2
    rows = (
        (0.0, 0.40, 0.02, half),
        (half, 0.0, 0.44, 0.0),
        (0.0, 0.0, 0.03, half),
        (0.0, 0.42, 0.0, -half),
        (0.0, 0.0, 0.0, half),
        (0.0, 0.08, 0.0, 0.0),
    )
    bodies = (
        (12.0, (0.0, -0.10, 0.02), (0.10, 0.09, 0.08)),
        (9.0, (-0.22, 0.01, 0.06), (0.03, 0.16, 0.15)),
        (6.0, (0.0, 0.03, 0.05), (0.04, 0.03, 0.03)),
        (3.0, (0.0, -0.12, 0.01), (0.02, 0.008, 0.02)),
        (1.5, (0.0, 0.01, 0.03), (0.004, 0.004, 0.003)),
        (0.8, (0.01, 0.0, -0.03), (0.001, 0.001, 0.001)),
    )
    friction = (
        (6.0, -1.5, 9.0),
        (8.0, -2.0, 12.0),
        (4.0, -1.0, 6.0),
        (1.5, -0.3, 1.2),
        (1.2, -0.3, 1.0),
        (0.8, -0.2, 0.5),
    )
    limits = [JointLimits((-2.6, 2.6), 2.0, 6.0, 300.0)] * 3 + [JointLimits((-2.2, 2.2), 2.6, 9.0, 80.0)] * 3
    return _arm("six", [dh_segment(*row) for row in rows], bodies, friction, limits)


def _seven() -> Robot:
    """A light arm with a redundant joint."""
    half = np.pi / 2
    rows = (
        (0.0, 0.33, 0.0, 0.0),
        (0.0, 0.0, 0.0, -half),
        (0.0, 0.32, 0.0, half),
        (0.0, 0.0, 0.08, half),
        (0.0, 0.38, -0.08, -half),
        (0.0, 0.0, 0.0, half),
        (0.0, 0.0, 0.09, half),
    )
    bodies = (
        (4.0, (0.0, -0.03, -0.08), (0.03, 0.03, 0.01)),
        (4.0, (0.0, -0.08, 0.03), (0.03, 0.01, 0.03)),
        (3.0, (0.04, 0.02, -0.05), (0.02, 0.02, 0.01)),
        (3.0, (-0.04, 0.06, 0.02), (0.02, 0.01, 0.02)),
        (2.5, (0.0, 0.04, -0.12), (0.02, 0.02, 0.006)),
        (1.5, (0.05, 0.0, 0.0), (0.003, 0.006, 0.006)),
        (0.8, (0.01, 0.01, 0.06), (0.002, 0.002, 0.001)),
    )
    friction = (
        (1.5, -0.3, 1.5),
        (2.0, -0.4, 2.0),
        (1.5, -0.3, 1.2),
        (1.5, -0.3, 1.2),
        (0.8, -0.2, 0.6),
        (0.6, -0.1, 0.4),
        (0.5, -0.1, 0.3),
    )
    limits = [JointLimits((-2.5, 2.5), 2.0, 6.0, 90.0)] * 4 + [JointLimits((-2.5, 2.5), 2.4, 8.0, 20.0)] * 3
    return _arm("seven", [mdh_segment(*row) for row in rows], bodies, friction, limits)


def _arm(
    name: str,
    segments: list[Segment],
    bodies: tuple[tuple[float, tuple[float, ...], tuple[float, ...]], ...],
    friction: tuple[tuple[float, float, float], ...],
    limits: list[JointLimits],
) -> Robot:
    shape = FrictionShape(k_v=300.0, delta=8.0)
    joints = tuple(
        Joint(f"joint{number}", segment.type, limits=limit, friction_shape=shape)
        for number, (segment, limit) in enumerate(zip(segments, limits, strict=True), 1)
    )
    model = Model(tuple(_link(*body) for body in bodies), tuple(FrictionCoefficients(*each) for each in friction))
    return Robot(name, joints, tuple(segments), np.array([0.0, 0.0, -9.81]), model=model)


def _link(mass: float, centre: tuple[float, ...], moments: tuple[float, ...]) -> LinkInertia:
    """A body by its mass, its centre and its moments about that centre, axes of the link frame."""
    c = np.array(centre)
    return LinkInertia(mass, mass * c, np.diag(moments) + mass * (c @ c * np.eye(3) - np.outer(c, c)))
