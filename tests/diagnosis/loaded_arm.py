"""The paper's arm with something at its tool: torque by simulating the arm with and without it."""

from dataclasses import replace

import numpy as np

from diagnosis.diagnosed_arm import POSITION_NOISE, motions
from identification.simulated import PAPER_NOISE, Array, SimulatedArm, paper_robot, simulate
from tauscope.recording import Recording
from tauscope.robot import LinkInertia, Robot


def carrying(robot: Robot, mass: float, place: Array) -> Robot:
    """The robot file's arm with a point mass on its last link."""
    assert robot.model.links is not None
    *others, last = robot.model.links
    about_origin = mass * (place @ place * np.eye(3) - np.outer(place, place))
    body = LinkInertia(mass, mass * place, about_origin)
    both = LinkInertia.from_vector(last.to_vector() + body.to_vector())
    return replace(robot, model=replace(robot.model, links=(*others, both)))


def torque_of_load(seed: int, mass: float, place: Array) -> Array:
    """What a point mass adds to the torque along a motion of `motions`, (N, n)."""
    loaded = simulate(carrying(paper_robot(), mass, place), seed=seed, periods=2)
    return loaded.exact.torque_exact - simulate(paper_robot(), seed=seed, periods=2).exact.torque_exact


def noisy(arm: SimulatedArm, extra: Array | float, seed: int, rng: np.random.Generator) -> Recording:
    """What a logger leaves of a motion."""
    noise = POSITION_NOISE * rng.standard_normal(arm.exact.torque_exact.shape)
    return arm.recording(arm.white(PAPER_NOISE, rng), noise, extra_torque=extra, name=f"motion-{seed}")


def exact_motion(seed: int, seeds: tuple[int, ...]) -> SimulatedArm:
    """One of the cached motions."""
    return dict(zip(seeds, motions(seeds), strict=True))[seed][0]


def seconds(arm: SimulatedArm) -> Array:
    """Instants from the beginning of the recording [s]."""
    return arm.exact.time - arm.exact.time[0]
