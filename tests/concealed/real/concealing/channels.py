"""What happens to the torque channel: another gain, a wrong sign, a delay, a limit."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.ground import Ground

Array = NDArray[np.float64]

LARGEST_GAIN = 0.5
LATEST_S = 0.1
"""A USB or ROS chain is hardly later."""

CLIPPED = (0.3, 0.98)
"""Levels of a limit, relative to the joint's largest torque."""

FLIPPED = -2.0
"""g of a torque (1 + g) τ whose sign is wrong."""


def scale_torque(torque: Array, joints: list[int], gain: float) -> Array:
    """(1 + g) τ at some joints."""
    scaled = torque.copy()
    scaled[:, joints] *= 1.0 + gain
    return scaled


def delay_torque(time: Array, torque: Array, joints: list[int], delay: float) -> Array:
    """τ(t - d) at some joints; beyond the recording it stands still."""
    late = torque.copy()
    late[:, joints] = CubicSpline(time, torque[:, joints])(np.clip(time - delay, time[0], time[-1]))
    return late


def clip_torque(torque: Array, joint: int, level: float) -> Array:
    """A torque that is recorded up to a level."""
    clipped = torque.copy()
    clipped[:, joint] = np.clip(clipped[:, joint], -level, level)
    return clipped


def gain_joint(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """A torque constant that is wrong. Of arms of one joint nothing tells it, nor where all joints have it."""
    if ground.robot.joint_count == 1 or not ground.moves(joint):
        return None
    side = float(rng.choice([-1.0, 1.0]))
    return Concealment(
        "gain_joint",
        joint,
        (f"torque_gain_error@{ground.names[joint]}",),
        lambda size: {"g": side * size},
        (0.01, LARGEST_GAIN),
        report=lambda passage, size: scale_torque(passage.torque, [joint], side * size),
        constants={"side": side},
    )


def sign_joint(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """A sign that is wrong at one joint of several, one that reverses: friction tells it."""
    if ground.robot.joint_count == 1 or not ground.reverses(joint):
        return None
    return _flip("sign_joint", ground, joint, [joint], (f"torque_gain_error@{ground.names[joint]}",))


def sign_all(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """A sign that is wrong throughout: friction and inertia tell it where the joint reverses."""
    if not ground.reverses(joint):
        return None
    labels = ("torque_gain_error",)
    if ground.robot.joint_count == 1:
        labels = (*labels, f"torque_gain_error@{ground.names[0]}")
    return _flip("sign_all", ground, joint, list(range(ground.robot.joint_count)), labels)


def _flip(kind: str, ground: Ground, joint: int, joints: list[int], labels: tuple[str, ...]) -> Concealment:
    return Concealment(
        kind,
        joint,
        labels,
        lambda size: {"g": size},
        (FLIPPED, FLIPPED),
        report=lambda passage, size: scale_torque(passage.torque, joints, size),
        fixed=FLIPPED,
    )


def delay_joint(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """Torque of one joint of several late against its positions, or the positions late. Where it moves."""
    if ground.robot.joint_count == 1 or not ground.moves(joint):
        return None
    return _delay("delay_joint", joint, [joint], (f"time_delay@{ground.names[joint]}",), rng)


def delay_all(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """The same of all joints. Where the joint moves."""
    if not ground.moves(joint):
        return None
    labels = ("time_delay",)
    if ground.robot.joint_count == 1:
        labels = (*labels, f"time_delay@{ground.names[0]}")
    return _delay("delay_all", joint, list(range(ground.robot.joint_count)), labels, rng)


def _delay(kind: str, joint: int, joints: list[int], labels: tuple[str, ...], rng: np.random.Generator) -> Concealment:
    side = float(rng.choice([-1.0, 1.0]))
    return Concealment(
        kind,
        joint,
        labels,
        lambda size: {"d": side * size},
        (1e-4, LATEST_S),
        report=lambda passage, size: delay_torque(passage.time, passage.torque, joints, side * size),
        constants={"side": side},
    )


def saturation(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """A torque that is cut off at a level. The less the level, the more is missing."""
    peak = float(ground.peak[joint])
    return Concealment(
        "saturation",
        joint,
        (f"torque_saturation@{ground.names[joint]}",),
        lambda size: {"c": size},
        (CLIPPED[0] * peak, CLIPPED[1] * peak),
        report=lambda passage, size: clip_torque(passage.torque, joint, size),
    )
