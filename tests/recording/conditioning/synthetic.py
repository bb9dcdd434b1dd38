"""Recordings whose motion is known in closed form."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from arms import arm, dh_segment
from tauscope.recording.conditioning import Motion
from tauscope.recording.recording import Recording
from tauscope.robot.robot import JointType, Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Harmonics:
    """q_j(t) = c_j + Σ_l a_jl sin(2π f_l t + φ_jl), and its derivatives."""

    frequency_hz: Array
    amplitude: Array
    phase: Array
    centre: Array

    def derivative(self, time: Array, order: int) -> Array:
        """q, q̇ or q̈ at some instants, (N, n)."""
        omega = 2.0 * np.pi * self.frequency_hz
        angle = omega * time[:, None, None] + self.phase + order * np.pi / 2
        values = np.sum(self.amplitude * omega**order * np.sin(angle), axis=2)
        return values + (self.centre if order == 0 else 0.0)


def harmonics(joints: int = 2, fundamental_hz: float = 0.1, count: int = 5, seed: int = 0) -> Harmonics:
    """A lively random motion of some harmonics."""
    rng = np.random.default_rng(seed)
    amplitude = rng.uniform(0.05, 0.3, (joints, count))
    phase = rng.uniform(0.0, 2.0 * np.pi, (joints, count))
    return Harmonics(fundamental_hz * np.arange(1.0, count + 1.0), amplitude, phase, rng.uniform(-1.0, 1.0, joints))


def robot(joints: int = 2, prismatic: tuple[int, ...] = ()) -> Robot:
    """An arm of so many joints; its geometry does not matter here."""
    kinds = [JointType.PRISMATIC if joint in prismatic else JointType.REVOLUTE for joint in range(joints)]
    return arm("any", [dh_segment(0.1, 0.2, 0.3, 0.5, kind) for kind in kinds])


def torque_of(motion: Harmonics, time: Array) -> Array:
    """A torque that any part of the motion leaves its mark on: τ = q̈ + 2 q̇ + 3 q."""
    return motion.derivative(time, 2) + 2.0 * motion.derivative(time, 1) + 3.0 * motion.derivative(time, 0)


def record(
    motion: Harmonics,
    time: Array,
    *,
    position: Array | None = None,
    effort: Array | None = None,
    velocity: Array | None = None,
    acceleration: Array | None = None,
    period: Array | None = None,
) -> Recording:
    """A recording without noise, where its columns are not given."""
    return Recording.from_arrays(
        "test.csv",
        time,
        motion.derivative(time, 0) if position is None else position,
        torque_of(motion, time) if effort is None else effort,
        velocity=velocity,
        acceleration=acceleration,
        period=period,
    )


def own_samples(motion: Motion) -> Array:
    """Instants that belong to this piece and no other."""
    return motion.time[motion.own]
