"""Rows of two simulated joints on smooth motion, with a residual of the test's own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tauscope.headroom.motion_rows import MotionRows
from tauscope.recording.recording import Array

RATE_HZ = 30.0
Law = Callable[[MotionRows], Array]
"""From the motion to a torque (M,) of the first joint that no model has."""


def motion(seed: int, recording: int, duration_s: float = 40.0) -> MotionRows:
    """Two joints on random harmonics; both models are zero, and so is the torque."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, duration_s, 1.0 / RATE_HZ)
    angular = 2.0 * np.pi * rng.uniform(0.05, 0.5, (2, 5, 1))
    size, phase = rng.uniform(0.2, 0.6, (2, 5, 1)), rng.uniform(0.0, 2.0 * np.pi, (2, 5, 1))
    angle = angular * time + phase
    position = (size * np.sin(angle)).sum(axis=1)
    none = np.zeros_like(position)
    return MotionRows(
        recording=recording,
        time=time,
        progress=time / duration_s * (1.0 - 1e-9),
        position=position,
        velocity=(size * angular * np.cos(angle)).sum(axis=1),
        acceleration=-(size * angular**2 * np.sin(angle)).sum(axis=1),
        load=3.0 * np.cos(position),
        torque=none,
        plain=none,
        explained=none,
        used=np.ones(position.shape, dtype=bool),
    )


def with_torque(rows: MotionRows, law: Law, noise: Array) -> MotionRows:
    """The same with a law and noise (M,) in the first joint's torque."""
    torque = rows.torque.copy()
    torque[0] = law(rows) + noise
    return replace(rows, torque=torque)


def recordings(
    law: Law, noise_std: float, seed: int, count: int = 2, duration_s: float = 40.0
) -> tuple[list[MotionRows], list[MotionRows]]:
    """Training recordings, and one that is held out."""
    rng = np.random.default_rng(seed)
    made = [motion(100 * seed + place, place, duration_s) for place in range(count + 1)]
    found = [with_torque(each, law, noise_std * rng.standard_normal(len(each.time))) for each in made]
    return found[:-1], found[-1:]
