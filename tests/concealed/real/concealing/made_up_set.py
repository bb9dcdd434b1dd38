"""A set of recordings like the open ones, made by Pinocchio: for tests where those are absent."""

from pathlib import Path

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from concealed.generator.arms import arm_named, file_without_truth
from concealed.real.concealing.ground import Ground, ground_of
from pinocchio_arm import pinocchio_model
from tauscope.recording import Recording, write_recording
from tauscope.robot import Robot

Array = NDArray[np.float64]

BAND_HZ = 8.0
RATE_HZ = 200.0
NOISE = 0.4
MOTIONS = {"train-1": (16.0, 1), "train-2": (10.0, 2), "held-out-1": (12.0, 3)}
"""Duration [s] and seed of each."""


def made_up_set(folder: Path, arm: str = "six") -> Ground:
    """Write a robot file and its recordings, and read them as a set."""
    robot = arm_named(arm)
    file_without_truth(arm, folder / "robot.yaml", states_friction=False)
    for name, (duration, seed) in MOTIONS.items():
        write_recording(_recording(robot, duration, seed), folder / f"{name}.csv")
    return ground_of(folder, BAND_HZ)


def _recording(robot: Robot, duration: float, seed: int) -> Recording:
    rng, count = np.random.default_rng(seed), robot.joint_count
    time = np.arange(int(duration * RATE_HZ)) / RATE_HZ
    rate = 2.0 * np.pi * rng.uniform(0.15, 0.7, (4, count))
    phase, size = rng.uniform(-np.pi, np.pi, (4, count)), rng.uniform(0.15, 0.35, (4, count))
    turn = rate * time[:, None, None] + phase
    q = np.sum(size * np.sin(turn), axis=1)
    qd = np.sum(size * rate * np.cos(turn), axis=1)
    qdd = -np.sum(size * rate**2 * np.sin(turn), axis=1)
    torque = pinocchio_torque(robot, q, qd, qdd) + 2.0 * np.tanh(qd / 0.02) + 1.5 * qd
    noise = NOISE * rng.standard_normal(q.shape)
    return Recording.from_arrays(f"motion{seed}", time, np.round(q, 6), torque + noise)


def pinocchio_torque(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    """Inverse dynamics of the robot file's links, (N, n)."""
    links = robot.model.links or ()
    model = pinocchio_model(robot, np.concatenate([link.to_vector() for link in links]))
    data = model.createData()
    return np.array([pinocchio.rnea(model, data, *state) for state in zip(q, qd, qdd, strict=True)])
