"""Physics that no catalogue has: laws of the motion whose names nobody knows."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from concealed.generator.forward import Passage
from concealed.generator.rates import FINE, RATE_HZ

Array = NDArray[np.float64]
Law = Callable[[Passage, int, np.random.Generator], Array]


def _others(passage: Passage, joint: int) -> tuple[int, int]:
    count = passage.position.shape[1]
    return (joint + 1) % count, (joint + 2) % count


def speed_in_waves(passage: Passage, joint: int, rng: np.random.Generator) -> Array:
    """Drag of one joint that depends on two angles."""
    other, third = _others(passage, joint)
    q, v = passage.position, passage.velocity
    return np.asarray(np.sin(2.5 * q[:, other] + rng.uniform(0, 6)) * np.cos(1.7 * q[:, joint]) * v[:, third])


def vibration(passage: Passage, joint: int, rng: np.random.Generator) -> Array:
    """A machine beside the arm."""
    time = np.arange(len(passage.position)) / (FINE * RATE_HZ)
    return np.asarray(np.sin(2.0 * np.pi * 3.37 * time + rng.uniform(0, 6)))


def bump(passage: Passage, joint: int, rng: np.random.Generator) -> Array:
    """Something that is touched at one place of two joints' plane."""
    other, _ = _others(passage, joint)
    q = passage.position[:, [joint, other]]
    centre = q[rng.integers(len(q) // 5, len(q))]
    return np.asarray(np.exp(-np.sum(((q - centre) / (0.25 * np.ptp(q, axis=0))) ** 2, axis=1)))


def slipstream(passage: Passage, joint: int, rng: np.random.Generator) -> Array:
    """Coulomb friction that grows with another joint's speed."""
    other, _ = _others(passage, joint)
    return np.asarray(np.abs(passage.velocity[:, other]) * np.tanh(50.0 * passage.velocity[:, joint]))


def crossed_spring(passage: Passage, joint: int, rng: np.random.Generator) -> Array:
    """A band stretched over two joints, softer the farther it goes."""
    other, third = _others(passage, joint)
    q = passage.position
    return np.asarray(np.sin(1.3 * q[:, joint] + 2.1 * q[:, other] + rng.uniform(0, 6)) * np.cos(1.1 * q[:, third]))


UNKNOWN: dict[str, Law] = {law.__name__: law for law in (speed_in_waves, vibration, bump, slipstream, crossed_spring)}
