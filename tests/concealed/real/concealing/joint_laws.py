"""Laws of the torque of one joint or two: formulas of their own, without a word of the product's catalogue.

Every function draws the constants of one effect at one joint from random numbers, or gives None where the recorded
motion cannot show it, by the rule in its docstring. All torques are those that the drive has to deliver in addition:
friction that is added dissipates at every instant.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.ground import Ground
from concealed.real.concealing.nominal import soft_sign
from concealed.real.concealing.passage import Passage

Array = NDArray[np.float64]
Draw = Callable[[Ground, int, np.random.Generator], Concealment | None]

TURN = 0.02
"""Speed at which friction turns, relative to the joint's rms speed."""

MOST_WAVES = 60.0
"""Largest order of a wave [1/rad or 1/m times the encoder's turn]: motors of 30 pole pairs end there."""

COUNTS = 5.0
"""Shortest bristle, in encoder counts: shorter ones are the encoder."""

BRISTLES = (0.003, 0.03)
"""Bristle lengths, relative to the joint's range."""


def _at(joint: int, values: Array, count: int) -> Array:
    torque = np.zeros((len(values), count))
    torque[:, joint] = values
    return torque


def _one_joint(
    ground: Ground,
    kind: str,
    joint: int,
    effect: str,
    law: Callable[[Passage, Array], Array],
    parameters: Callable[[float], dict[str, float]],
    *,
    largest: float = np.inf,
    **constants: float,
) -> Concealment:
    """A law whose torque (N,) acts at its joint alone."""
    count = ground.robot.joint_count
    return Concealment(
        kind,
        joint,
        (f"{effect}@{ground.names[joint]}",),
        parameters,
        (0.0, largest),
        torque=lambda passage, load: _at(joint, law(passage, load[:, joint]), count),
        constants=constants,
    )


def _sign(ground: Ground, joint: int, passage: Passage) -> Array:
    return soft_sign(passage.velocity[:, joint], TURN * float(ground.speed[joint]))


def spring(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = ±k (q - q_0). Where the joint moves."""
    if not ground.moves(joint):
        return None
    middle, side = 0.5 * (ground.low + ground.high)[joint], float(rng.choice([-1.0, 1.0]))
    return _one_joint(
        ground,
        "spring",
        joint,
        "joint_spring",
        lambda passage, _: side * (passage.position[:, joint] - middle),
        lambda size: {"k": side * size},
        side=side,
    )


def cable(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = ±k x^p, x how far a hose is stretched past an angle within the range. Where the joint moves."""
    if not ground.moves(joint):
        return None
    side, share = float(rng.choice([-1.0, 1.0])), float(rng.uniform(0.3, 0.7))
    power = float(rng.choice([1.0, 1.5, 2.0]))
    taut = float(ground.low[joint] + share * ground.reach[joint])

    def law(passage: Passage, _load: Array) -> Array:
        stretch = side * (passage.position[:, joint] - taut)
        return np.asarray(side * (0.5 * (stretch + np.abs(stretch))) ** power)

    return _one_joint(
        ground, "cable", joint, "cable_force", law, lambda size: {"k": size, "q_t": taut, "p": power}, side=side
    )


def _order(ground: Ground, joint: int, rng: np.random.Generator) -> float | None:
    """Order of a wave that the range holds twice and the band can pass at 95 of 100 instants.

    A whole multiple of the motor's turns where the robot file states a gear ratio.
    """
    if not ground.moves(joint):
        return None
    lowest = 4.0 * np.pi / float(ground.reach[joint])
    highest = min(2.0 * np.pi * ground.band_hz / float(ground.fastest[joint]), max(MOST_WAVES, 1.5 * lowest))
    gear = ground.robot.joints[joint].gear_ratio
    if gear is None:
        return float(np.exp(rng.uniform(np.log(lowest), np.log(highest)))) if highest > lowest else None
    multiples = np.arange(np.ceil(lowest / gear), max(highest, gear) // gear + 1)
    multiples = multiples[multiples * gear <= 2.0 * np.pi * ground.band_hz / float(ground.fastest[joint])]
    return float(gear * rng.choice(multiples)) if len(multiples) else None


def cogging(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = a sin(k q + φ). Where there is an order that the range and the band hold."""
    order, phase = _order(ground, joint, rng), float(rng.uniform(-np.pi, np.pi))
    if order is None:
        return None
    return _one_joint(
        ground,
        "cogging",
        joint,
        "cogging",
        lambda passage, _: np.sin(order * passage.position[:, joint] + phase),
        lambda size: {"amplitude": size, "order": order},
        phase=phase,
        resolution=2.0 * np.pi / float(ground.reach[joint]),
    )


def ripple(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = a τ_rb sin(k q + φ), a at most a half. Where there is an order that the range and the band hold."""
    order, phase = _order(ground, joint, rng), float(rng.uniform(-np.pi, np.pi))
    if order is None:
        return None
    return _one_joint(
        ground,
        "ripple",
        joint,
        "torque_ripple",
        lambda passage, load: load * np.sin(order * passage.position[:, joint] + phase),
        lambda size: {"amplitude": size, "order": order},
        largest=0.5,
        phase=phase,
        resolution=2.0 * np.pi / float(ground.reach[joint]),
    )


def load_friction(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = μ |τ_rb| sgn q̇, μ at most a half, as a worm's. Where the joint reverses."""
    if not ground.reverses(joint):
        return None
    return _one_joint(
        ground,
        "load_friction",
        joint,
        "load_dependent_friction",
        lambda passage, load: np.abs(load) * _sign(ground, joint, passage),
        lambda size: {"mu": size},
        largest=0.5,
    )


def asymmetric_coulomb(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = a (sgn q̇ ± |sgn q̇|): Coulomb friction in one direction alone. Where the joint reverses."""
    if not ground.reverses(joint):
        return None
    side = float(rng.choice([-1.0, 1.0]))

    def law(passage: Passage, _load: Array) -> Array:
        sign = _sign(ground, joint, passage)
        return np.asarray(sign + side * np.abs(sign))

    return _one_joint(
        ground, "asymmetric_coulomb", joint, "asymmetric_coulomb", law, lambda size: {"a": side * size}, side=side
    )


def asymmetric_viscous(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = b (q̇ ± |q̇|): viscous friction in one direction alone. Where the joint reverses."""
    if not ground.reverses(joint):
        return None
    side = float(rng.choice([-1.0, 1.0]))
    return _one_joint(
        ground,
        "asymmetric_viscous",
        joint,
        "asymmetric_viscous",
        lambda passage, _: passage.velocity[:, joint] + side * np.abs(passage.velocity[:, joint]),
        lambda size: {"b": side * size},
        side=side,
    )


def nonlinear_viscous(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = c q̇ |q̇|^(p-1), p far from 0 and 1. Where the joint reverses."""
    if not ground.reverses(joint):
        return None
    power = float(rng.choice([rng.uniform(0.35, 0.6), rng.uniform(1.6, 2.6)]))
    return _one_joint(
        ground,
        "nonlinear_viscous",
        joint,
        "nonlinear_viscous",
        lambda passage, _: np.sign(passage.velocity[:, joint]) * np.abs(passage.velocity[:, joint]) ** power,
        lambda size: {"c": size, "p": power},
    )


def position_friction(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = a (1 + cos(k q + φ)) sgn q̇, half a wave to two and a half over the range. Where the joint reverses."""
    if not ground.reverses(joint):
        return None
    order = float(2.0 * np.pi * rng.uniform(0.5, 2.5) / ground.reach[joint])
    phase = float(rng.uniform(-np.pi, np.pi))
    return _one_joint(
        ground,
        "position_friction",
        joint,
        "position_dependent_friction",
        lambda passage, _: (1.0 + np.cos(order * passage.position[:, joint] + phase)) * _sign(ground, joint, passage),
        lambda size: {"amplitude": size, "k": order},
        phase=phase,
    )


def bristles(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = F z, z of Dahl or LuGre, added to the friction that is there.

    Where the joint reverses, and five encoder counts are less than three hundredths of its range.
    """
    shortest = max(COUNTS * float(ground.count[joint]), BRISTLES[0] * float(ground.reach[joint]))
    longest = BRISTLES[1] * float(ground.reach[joint])
    if not ground.reverses(joint) or shortest > longest:
        return None
    length = float(np.exp(rng.uniform(np.log(shortest), np.log(longest))))
    lugre = bool(rng.choice([False, True]))
    turn = 0.1 * float(ground.speed[joint]) if lugre else None
    return _one_joint(
        ground,
        "bristles",
        joint,
        "presliding_hysteresis",
        lambda passage, _: bristle_force(passage.position[:, joint], passage.velocity[:, joint], length, turn),
        lambda size: {"F": size, "x_s": length},
        lugre=float(lugre),
    )


def bristle_force(position: Array, velocity: Array, length: float, turn: float | None) -> Array:
    """Deflection z (N,) of dz/dq = (sgn q̇ - z / g) / x_s, by the exact step of constant g.

    g = 1 is Dahl's bristle; LuGre's has g = 1 + 0.3 exp(-(q̇ / v_s)²), which is 30 % more to break away.
    """
    level = np.ones(len(position)) if turn is None else 1.0 + 0.3 * np.exp(-((velocity / turn) ** 2))
    z, force = 0.0, np.empty(len(position))
    for k, (before, after) in enumerate(pairwise(np.concatenate([position[:1], position]))):
        step = after - before
        end = np.sign(step) * level[k]
        z = end + (z - end) * np.exp(-abs(step) / (length * level[k]))
        force[k] = z
    return force


def drift(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ = f exp(-t/T) sgn q̇: friction of a cold joint that is warm T after each recording begins.

    Where the joint reverses in the first and in the last third of the longest training recording.
    """
    longest = max(ground.training, key=lambda each: each.time[-1])
    thirds = np.array_split(longest.velocity[:, joint], 3)
    both_ways = all((part > 0.0).any() and (part < 0.0).any() for part in (thirds[0], thirds[2]))
    if not ground.reverses(joint) or not both_ways:
        return None
    duration = float(longest.time[-1])
    constant = float(duration * rng.uniform(0.15, 0.7))
    whole = -np.expm1(-duration / constant)
    return _one_joint(
        ground,
        "drift",
        joint,
        "friction_drift",
        lambda passage, _: np.exp(-passage.time / constant) * _sign(ground, joint, passage),
        lambda size: {"f": -size * float(whole), "T": constant},
    )


def coupling(ground: Ground, joint: int, rng: np.random.Generator) -> Concealment | None:
    """τ_j = f sgn(q̇_j ± q̇_k), τ_k = ± the same, k the next joint. Where both reverse."""
    other, side = joint + 1, float(rng.choice([-1.0, 1.0]))
    if other >= ground.robot.joint_count or not (ground.reverses(joint) and ground.reverses(other)):
        return None
    turn = TURN * float(np.hypot(ground.speed[joint], ground.speed[other]))

    def torque(passage: Passage, load: Array) -> Array:
        friction = soft_sign(passage.velocity[:, joint] + side * passage.velocity[:, other], turn)
        return _at(joint, friction, load.shape[1]) + _at(other, side * friction, load.shape[1])

    labels = tuple(f"friction_coupling@{ground.names[each]}" for each in (joint, other))
    constants = {"other": float(other), "side": side}
    return Concealment(
        "coupling", joint, labels, lambda size: {"f": size}, (0.0, np.inf), torque=torque, constants=constants
    )
