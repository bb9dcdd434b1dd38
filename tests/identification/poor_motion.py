"""Arms that move as on a first day: jogs, point to point, hardly at all, sampled slowly, or for seconds only."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from arms import panda_like, paper_arm, ur5_like
from pinocchio_arm import pinocchio_model
from tauscope.recording import Recording, read_recording
from tauscope.robot import Joint, LinkInertia, Model, Robot

Array = NDArray[np.float64]

COULOMB_SPEED = 0.003
"""Speed at which dry friction has three quarters of its level [rad/s]."""


def body(rng: np.random.Generator, mass: float, size: float) -> LinkInertia:
    """A solid box of random proportions somewhere within the link's reach."""
    centre = rng.uniform(-0.5, 0.5, 3) * size
    spread = np.diag(rng.uniform(0.05, 0.35, 3) * size) ** 2
    about = spread + np.outer(centre, centre)
    return LinkInertia(mass, mass * centre, mass * (np.trace(about) * np.eye(3) - about))


def believed(link: LinkInertia, rng: np.random.Generator, deviation: float) -> LinkInertia:
    """What a file states of a link: a body as far from the truth as files are."""
    scale = float(np.exp(deviation * rng.standard_normal()))
    centre = link.first_moment / link.mass
    moved = centre + deviation * 0.05 * rng.standard_normal(3)
    shift = np.dot(moved, moved) * np.eye(3) - np.outer(moved, moved)
    own = link.inertia - link.mass * (np.dot(centre, centre) * np.eye(3) - np.outer(centre, centre))
    return LinkInertia(scale * link.mass, scale * link.mass * moved, scale * (own + link.mass * shift))


def smooth(part: Array) -> Array:
    """A step from 0 to 1 without jerk at its ends."""
    part = np.clip(part, 0.0, 1.0)
    return part**3 * (10.0 - 15.0 * part + 6.0 * part**2)


def visit(postures: Array, move_s: float, dwell_s: float, rate_hz: float) -> Array:
    """From posture to posture, each move followed by a stop, (N, n)."""
    time = np.arange(0.0, (move_s + dwell_s) * (len(postures) - 1), 1.0 / rate_hz)
    q = np.tile(postures[0], (len(time), 1))
    for index, (here, there) in enumerate(itertools.pairwise(postures)):
        q += smooth((time - index * (move_s + dwell_s)) / move_s)[:, None] * (there - here)
    return q


def jogs(rng: np.random.Generator, joints: int) -> tuple[Array, float]:
    """One joint after another, out and back."""
    home = rng.uniform(-1.0, 1.0, joints)
    postures = [home]
    for joint in range(joints):
        for reach in (rng.uniform(0.4, 1.0), -rng.uniform(0.4, 1.0), 0.0):
            postures.append(home + reach * np.eye(joints)[joint])
    return visit(np.array(postures), rng.uniform(1.0, 2.0), rng.uniform(0.2, 0.6), 100.0), 100.0


def points(rng: np.random.Generator, joints: int) -> tuple[Array, float]:
    """Point to point with stops, all joints together."""
    return visit(rng.uniform(-1.2, 1.2, (rng.integers(6, 14), joints)), rng.uniform(1.0, 2.0), 1.0, 125.0), 125.0


def standing(rng: np.random.Generator, joints: int) -> tuple[Array, float]:
    """A few postures, slowly reached and long held."""
    return visit(rng.uniform(-1.2, 1.2, (6, joints)), 6.0, 4.0, 50.0), 50.0


def waves(rng: np.random.Generator, joints: int, duration_s: float, rate_hz: float) -> Array:
    """A sum of sines."""
    time = np.arange(0.0, duration_s, 1.0 / rate_hz)
    harmonics = np.arange(1, 5)
    phase = 2.0 * np.pi * np.outer(time, harmonics) / 10.0
    amplitude = rng.normal(0.0, 0.35, (2, 4, joints)) / harmonics[None, :, None] ** 0.5
    return np.cos(phase) @ amplitude[0] + np.sin(phase) @ amplitude[1]


MOTIONS: dict[str, Callable[[np.random.Generator, int], tuple[Array, float]]] = {
    "jogs": jogs,
    "points": points,
    "standing": standing,
    "slow rate": lambda rng, joints: (waves(rng, joints, 15.0, 30.0), 30.0),
    "short": lambda rng, joints: (waves(rng, joints, 5.0, 100.0), 100.0),
}


def torque_of(robot: Robot, links: list[LinkInertia], q: Array, rate_hz: float, friction: Array, seed: int) -> Array:
    """Torque along a motion by Pinocchio, with Coulomb and viscous friction, which at rest holds with any torque."""
    rng = np.random.default_rng(seed)
    model = pinocchio_model(robot, np.concatenate([link.to_vector() for link in links]))
    data = model.createData()
    qd = np.gradient(q, 1.0 / rate_hz, axis=0, edge_order=2)
    qdd = np.gradient(qd, 1.0 / rate_hz, axis=0, edge_order=2)
    torque = np.array([pinocchio.rnea(model, data, *state) for state in zip(q, qd, qdd, strict=True)])
    coulomb, viscous = friction
    torque += coulomb * np.tanh(qd / COULOMB_SPEED) + viscous * qd
    for joint in range(q.shape[1]):
        resting = np.abs(qd[:, joint]) < 1e-6
        stops = np.cumsum(np.diff(resting.astype(int), prepend=0) > 0)
        held = rng.uniform(-1.0, 1.0, stops.max() + 1)[stops]
        torque[:, joint] += np.where(resting, 0.8 * coulomb[joint] * held, 0.0)
    return torque


def written(folder: Path, name: str, q: Array, torque: Array, rate_hz: float) -> Recording:
    """The recording as a file holds it."""
    joints = q.shape[1]
    header = ",".join(["t", *(f"q{j + 1}" for j in range(joints)), *(f"tau{j + 1}" for j in range(joints))])
    table = np.column_stack([np.arange(len(q)) / rate_hz, q, torque])
    path = folder / f"{name}.csv"
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=header, comments="")
    return read_recording(path, joints)


def poor_arm(seed: int, kind: str, folder: Path) -> tuple[Robot, Recording, Recording]:
    """A robot as its file has it, a poor recording, and motion that it did not see."""
    rng = np.random.default_rng(seed)
    arm = (paper_arm, ur5_like, panda_like)[rng.integers(3)]()
    count = arm.joint_count
    masses = np.sort(rng.uniform(0.3, 6.0, count))[::-1]
    links = [body(rng, float(mass), rng.uniform(0.1, 0.35)) for mass in masses]
    friction = np.stack([rng.uniform(0.1, 0.6, count), rng.uniform(0.05, 0.5, count)]) * np.sqrt(masses)
    step = float(10.0 ** rng.uniform(-6.0, -4.0))
    recordings = []
    q, rate = MOTIONS[kind](rng, count)
    for name, motion, rate_hz in (("train", q, rate), ("held-out", waves(rng, count, 12.0, rate), rate)):
        torque = torque_of(arm, links, motion, rate_hz, friction, int(rng.integers(1 << 30)))
        torque += rng.normal(0.0, 0.01 * torque.std(axis=0) + 0.01, torque.shape)
        recordings.append(written(folder, name, step * np.round(motion / step), torque, rate_hz))
    stated = tuple(believed(link, rng, 0.3) for link in links) if rng.uniform() < 0.5 else None
    joints = tuple(Joint(each.name, each.type) for each in arm.joints)
    return replace(arm, joints=joints, model=Model(links=stated)), recordings[0], recordings[1]
