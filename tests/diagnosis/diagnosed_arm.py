"""Recordings of the paper's arm with an effect written out here, never taken from the catalogue."""

from collections.abc import Callable
from functools import cache

import numpy as np

from identification.simulated import PAPER_NOISE, Array, SimulatedArm, paper_robot, simulate
from tauscope.recording import Recording
from tauscope.robot import FrictionCoefficients

EffectTorque = Callable[[SimulatedArm, Array], Array]
"""From the exact motion and its rigid-body torque (N, n) to the effect's torque (N, n)."""

POSITION_NOISE = 2e-5


@cache
def motions(seeds: tuple[int, ...]) -> tuple[tuple[SimulatedArm, Array], ...]:
    """Exact motions of the paper's arm, two periods of ten seconds each, with their torque without friction."""
    robot = paper_robot()
    still = (FrictionCoefficients(),) * robot.joint_count
    pairs = []
    for seed in seeds:
        arm = simulate(robot, seed=seed, periods=2)
        pairs.append((arm, simulate(robot, seed=seed, periods=2, friction=still).exact.torque_exact))
    return tuple(pairs)


def recordings(seeds: tuple[int, ...], effect: EffectTorque | None, rng: np.random.Generator) -> list[Recording]:
    """What a logger leaves of these motions, noise of the paper's size drawn anew."""
    made = []
    for (arm, rigid), seed in zip(motions(seeds), seeds, strict=True):
        extra = 0.0 if effect is None else effect(arm, rigid)
        noise = POSITION_NOISE * rng.standard_normal(rigid.shape)
        made.append(arm.recording(arm.white(PAPER_NOISE, rng), noise, extra_torque=extra, name=f"motion-{seed}"))
    return made


def at_joint(joint: int, torque: Array) -> Array:
    """Torque (N,) of one joint among three, (N, 3)."""
    whole = np.zeros((len(torque), 3))
    whole[:, joint] = torque
    return whole
