"""Sound recordings of arms large and small: nothing about them is to be refused or mended."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from arms import arm, dh_segment
from tauscope.dynamics.rigid_body import inverse_dynamics
from tauscope.recording import Recording
from tauscope.robot.robot import Joint, JointLimits, JointType, LinkInertia, Model, Robot

Array = NDArray[np.float64]


LIMITS = {"one-ton arm": (2.0, 5.0), "gantry": (3.0, 20.0), "motor": (300.0, 1e5)}
"""Largest speed and acceleration of some arms."""


@dataclass(frozen=True, eq=False)
class Sound:
    """A recording and the arm that made it."""

    robot: Robot
    recording: Recording


def record_sound_arm(seed: int, rows: int = 3000) -> Sound:
    """A recording drawn from all that arms do: 30 Hz to 20 kHz, 50 g to 1 t, jogs, sweeps, fast turns and rest."""
    rng = np.random.default_rng(seed)
    robot, parameters = _draw_arm(rng)
    n = robot.joint_count
    rate = float(np.exp(rng.uniform(np.log(30.0), np.log(20_000.0))))
    time = np.arange(rows) / rate
    q, qd, qdd = _draw_motion(rng, time, robot)
    torque = inverse_dynamics(robot, parameters, q, qd, qdd)
    level = np.maximum(np.abs(torque).max(axis=0), 1e-3)
    coulomb, viscous = rng.uniform(0.05, 0.4, n) * level, rng.uniform(0.0, 0.1, n) * level
    torque += coulomb * np.tanh(qd * 200.0) + viscous * qd / np.maximum(np.abs(qd).max(axis=0), 1e-9)
    torque += rng.normal(size=torque.shape) * rng.choice([0.002, 0.01, 0.05]) * level
    if rng.random() < 0.3:  # a drive that reports in steps
        step = level / rng.choice([50, 200, 1000])
        torque = np.rint(torque / step) * step
    position = q + rng.normal(size=q.shape) * rng.choice([1e-7, 1e-5])
    if rng.random() < 0.6:
        step = 2.0 * np.pi / 2 ** rng.integers(12, 21)
        position = np.rint(position / step) * step
    stamps = time + rng.uniform(-0.3, 0.3, rows) / rate * (rng.random() < 0.3)
    if rng.random() < 0.1:  # a buffer that is emptied four rows at a time
        stamps = time[np.arange(rows) // 4 * 4] + np.arange(rows) % 4 * 1e-3 / rate
    velocity = None
    if rng.random() < 0.5:
        velocity = qd * (100.0 if rng.random() < 0.2 else 1.0)  # some report the motor's
        velocity = velocity + rng.normal(size=qd.shape) * 0.01 * np.maximum(np.abs(velocity).max(axis=0), 1e-6)
    recording = Recording.from_arrays(f"sound-{seed}", stamps, position, torque, velocity=velocity)
    return Sound(robot, recording)


def _draw_arm(rng: np.random.Generator) -> tuple[Robot, Array]:
    """An arm and the standard parameters that it really has, (10 n,)."""
    kind = rng.choice(["arm", "servo arm", "one-ton arm", "gantry", "motor", "pendulum"])
    if kind == "motor":
        robot, size, mass = arm("motor", [dh_segment(0.0, 0.0, 0.0, 0.0)]), 0.05, 0.1
    elif kind == "pendulum":
        robot, size, mass = arm("pendulum", [dh_segment(0.0, 0.0, 0.1, 0.0)], (9.81, 0.0, 0.0)), 0.1, 0.5
    elif kind == "gantry":
        rows = [dh_segment(0.0, 0.0, 0.0, a, JointType.PRISMATIC) for a in (np.pi / 2, np.pi / 2, 0.0)]
        robot, size, mass = arm("gantry", rows), 0.5, 20.0
    else:
        size, mass = {"arm": (0.4, 4.0), "servo arm": (0.08, 0.06), "one-ton arm": (1.2, 300.0)}[str(kind)]
        n = int(rng.integers(2, 8))
        rows = [
            dh_segment(0.0, size * rng.uniform(0, 1), size * rng.uniform(0, 1), rng.choice([0, 1.57, -1.57]))
            for _ in range(n)
        ]
        robot = arm(str(kind), rows)
    links = [_draw_link(rng, mass * rng.uniform(0.3, 1.0), size) for _ in robot.joints]
    stated = [
        LinkInertia(link.mass * f, link.first_moment * f, link.inertia * f)
        for link in links
        for f in [rng.uniform(0.3, 3.0)]
    ]
    model = Model(tuple(stated)) if rng.random() < 0.5 else Model()
    joints = tuple(Joint(f"joint{k + 1}", j.type) for k, j in enumerate(robot.joints))
    return replace(robot, joints=joints, model=model), np.concatenate([link.to_vector() for link in links])


def _draw_link(rng: np.random.Generator, mass: float, size: float) -> LinkInertia:
    """A body of this mass and size."""
    points = rng.uniform(-size / 2, size / 2, (8, 3)) + rng.uniform(-size / 2, size / 2, 3)
    second = mass / 8 * points.T @ points
    return LinkInertia(mass, mass / 8 * points.sum(axis=0), np.trace(second) * np.eye(3) - second)


def _draw_motion(rng: np.random.Generator, time: Array, robot: Robot) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration, each (N, n)."""
    n, rows, length = robot.joint_count, len(time), float(time[-1])
    turns = 20.0 if robot.name == "motor" else 1.0
    style = rng.choice(["waves", "jogs", "sweep", "rest and waves"])
    reach = (
        np.array([0.2 if j.type is JointType.PRISMATIC else 1.0 for j in robot.joints]) * rng.uniform(0.2, 1.5) * turns
    )
    shape = 2 / np.pi * np.arcsin(0.98 * np.sin(4 * np.pi * time / length))
    knots = np.linspace(0.0, length, 2 * n + 2)
    q = np.zeros((rows, n))
    for joint in range(n):
        if style == "sweep":
            q[:, joint] = reach[joint] * shape
        elif style == "jogs":
            for begin, end, goal in ((2 * joint, 2 * joint + 1, 1.0), (2 * joint + 1, 2 * joint + 2, -1.0)):
                s = np.clip((time - knots[begin]) / (0.8 * (knots[end] - knots[begin])), 0.0, 1.0)
                q[:, joint] += goal * reach[joint] * (10 * s**3 - 15 * s**4 + 6 * s**5)
        else:
            fastest = max(1.0 / length, min(rng.uniform(0.2, 2.0), 3.0))
            for harmonic in range(1, 4):
                q[:, joint] += (
                    reach[joint]
                    / 3
                    * rng.normal()
                    * np.sin(2 * np.pi * fastest * harmonic / 2 * time + rng.uniform(0, 6))
                )
    if style == "rest and waves":
        s = np.clip((time / length - 0.3) / 0.3, 0.0, 1.0)
        q = q[0] + (q - q[0]) * (10 * s**3 - 15 * s**4 + 6 * s**5)[:, None]
    step = float(time[1] - time[0])
    qd = np.gradient(q, step, axis=0)
    qdd = np.gradient(qd, step, axis=0)
    fastest, hardest = LIMITS.get(robot.name, (20.0, 200.0))
    slow = np.maximum(np.maximum(np.abs(qd).max(axis=0) / fastest, np.abs(qdd).max(axis=0) / hardest), 1.0)
    return q / slow + rng.uniform(-1.0, 1.0, n), qd / slow, qdd / slow


def with_limits(robot: Robot, recording: Recording, rng: np.random.Generator) -> Robot:
    """The same arm with limits that its recording keeps."""
    samples = recording.samples()
    reach = np.nanmax(np.abs(samples.position), axis=0) * rng.uniform(1.0, 4.0)
    torque = np.nanmax(np.abs(samples.effort), axis=0) * rng.uniform(0.5, 4.0)
    joints = tuple(
        replace(joint, limits=JointLimits((-float(q), float(q)), torque=float(tau) or None))
        for joint, q, tau in zip(robot.joints, reach, torque, strict=True)
    )
    return replace(robot, joints=joints)
