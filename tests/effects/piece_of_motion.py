"""One piece of motion of a six-joint arm, with Pinocchio's torque as its load."""

from dataclasses import replace

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from arms import random_parameters, ur5_like
from pinocchio_arm import pinocchio_model
from tauscope.effects import ArmContext, Signals
from tauscope.robot import Robot

Array = NDArray[np.float64]

RATE = 1000.0
K_V = 80.0


def motion(robot: Robot, rng: np.random.Generator, samples: int = 4000) -> tuple[Array, Array, Array]:
    """A smooth motion that closes after its samples, with exact derivatives, (n, N) each."""
    time = np.arange(samples) / RATE
    omega = 2.0 * np.pi / (samples / RATE) * np.arange(1, 4)
    amplitude = rng.uniform(-0.5, 0.5, (2, robot.joint_count, 3))
    sine, cosine = np.sin(np.outer(omega, time)), np.cos(np.outer(omega, time))
    q = amplitude[0] @ sine + amplitude[1] @ cosine
    qd = (amplitude[0] * omega) @ cosine - (amplitude[1] * omega) @ sine
    qdd = -(amplitude[0] * omega**2) @ sine - (amplitude[1] * omega**2) @ cosine
    return q, qd, qdd


def signals(seed: int = 0) -> Signals:
    """Motion of a six-joint arm with Pinocchio's torque as the load."""
    rng = np.random.default_rng(seed)
    robot = ur5_like()
    links = random_parameters(rng, robot.joint_count)
    q, qd, qdd = motion(robot, rng)
    load = torque(robot, links, q, qd, qdd)
    step = 2.0 / np.pi * np.arctan(K_V * qd)
    return Signals(
        robot=robot,
        rate_hz=RATE,
        time=np.arange(8000).reshape(2, 4000) / RATE,
        recording=0,
        position=q,
        velocity=qd,
        acceleration=qdd,
        load=load,
        torque=load + 2.0 * step + 0.5 * qd,
        step=step,
        steepness=np.full(robot.joint_count, K_V),
        bodies=links,
        links=links,
        periodic=True,
    )


def torque(robot: Robot, links: Array, q: Array, qd: Array, qdd: Array) -> Array:
    """Inverse dynamics by Pinocchio, (n, N)."""
    model = pinocchio_model(robot, links)
    data = model.createData()
    rows = [pin.rnea(model, data, *state) for state in zip(q.T, qd.T, qdd.T, strict=True)]
    return np.array(rows).T


SIGNALS = signals()


def context(gear_ratio: float | None = None) -> ArmContext:
    s = SIGNALS
    robot = replace(s.robot, joints=tuple(replace(joint, gear_ratio=gear_ratio) for joint in s.robot.joints))
    return ArmContext(
        robot=robot,
        slowest=s.velocity.min(axis=1),
        fastest=s.velocity.max(axis=1),
        lowest=s.position.min(axis=1),
        highest=s.position.max(axis=1),
        speed=s.velocity.std(axis=1),
        top_speed=np.abs(s.velocity).max(axis=1),
        load=s.load.std(axis=1),
        top_torque=np.abs(s.torque).max(axis=1),
        inertia=np.full(6, 0.5),
        durations=(8.0,),
        cutoff_hz=30.0,
    )
