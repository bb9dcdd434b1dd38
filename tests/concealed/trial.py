"""One trial: an arm with something concealed, its recordings, and afterwards the truth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from concealed.arms import NOISE_STD, arm_named, without_truth
from concealed.effects import CATALOGUE, Drawn, Ground
from concealed.forward import Entry, Passage, passage, physical
from concealed.laws import with_law
from concealed.motions import RATE_HZ, Motion, campaign
from concealed.sensing import Noise, recording
from concealed.strength import foreseen_strength, strength
from concealed.unknown import UNKNOWN
from service.recording import Recording
from service.robot import Robot

DEVELOPMENT_SEEDS = range(10_000)
"""Seeds that may be looked at while the diagnosis is being made; those from a million are for reports only."""

CLOSE_ENOUGH = 0.12
"""Relative error of s that is accepted."""

MOST_PASSAGES = 4


@dataclass(frozen=True, eq=False)
class Trial:
    """What was concealed, and what was recorded.

    truth : tuple of Drawn
        the effects; none on a null trial
    entries : tuple of dict
        as in a scenario file
    strength : float
        s of all together
    robot : Robot
        without a trace of the truth
    train, held_out : list of Recording
        noisy
    noise : Noise
        of the sensors
    """

    truth: tuple[Drawn, ...]
    entries: tuple[Entry, ...]
    strength: float
    robot: Robot
    train: list[Recording]
    held_out: list[Recording]
    noise: Noise


def null_trial(arm: str, motion_seed: int, seed: int, *, states_friction: bool = True, **noise: object) -> Trial:
    """Nothing concealed."""
    return _recorded(arm, motion_seed, "rich", (), (), 0.0, seed, states_friction, noise)


def effect_trial(
    arm: str,
    effect: str,
    joint: int,
    wanted: float,
    *,
    motion_seed: int,
    seed: int,
    kind: str = "rich",
    states_friction: bool = True,
    **noise: object,
) -> Trial:
    """One effect at one joint with a wanted s."""
    drawn = CATALOGUE[effect](_ground(arm, motion_seed, joint), np.random.default_rng([seed, 5]))
    entry, found = sized(arm, drawn, wanted, motion_seed)
    return _recorded(arm, motion_seed, kind, (drawn,), (entry,), found, seed, states_friction, noise)


def pair_trial(
    arm: str, first: tuple[str, int], second: tuple[str, int], wanted: float, *, motion_seed: int, seed: int
) -> Trial:
    """Two effects, each of the wanted s alone."""
    truth, entries = [], []
    for place, (effect, joint) in enumerate((first, second)):
        drawn = CATALOGUE[effect](_ground(arm, motion_seed, joint), np.random.default_rng([seed, 5 + place]))
        entry, _ = sized(arm, drawn, wanted, motion_seed)
        truth.append(drawn)
        entries.append(entry)
    return _recorded(arm, motion_seed, "rich", tuple(truth), tuple(entries), wanted, seed, True, {})


def unknown_trial(arm: str, law: str, joint: int, wanted: float, *, motion_seed: int, seed: int) -> Trial:
    """Something at one joint that no catalogue has, with a wanted s."""
    robot = arm_named(arm)
    train, held_out = campaign(robot, motion_seed)
    noise = Noise(NOISE_STD[arm])

    def disturbed(motion: Motion, size: float) -> Passage:
        plain = passage(robot, [], motion)
        torque = plain.torque.copy()
        torque[:, joint] += size * UNKNOWN[law](plain, joint, np.random.default_rng([seed, 3]))
        return replace(plain, torque=torque)

    unit, _ = strength(robot, [], [disturbed(motion, 1.0) for motion in train], NOISE_STD[arm])
    rng = np.random.default_rng([seed, 9])
    made = [
        [recording(m, disturbed(m, wanted / unit), (), noise, rng) for m in motions] for motions in (train, held_out)
    ]
    truth = Drawn(lambda size: {}, wanted / unit, 1.0, (joint,), ("unknown",))
    return Trial((truth,), (), wanted, without_truth(robot, states_friction=True), made[0], made[1], noise)


def sized(arm: str, drawn: Drawn, wanted: float, motion_seed: int) -> tuple[Entry, float]:
    """The effect's entry at a wanted s on rich motion, and the s that it has."""
    robot = arm_named(arm)
    train, _ = campaign(robot, motion_seed)
    plain = [passage(robot, [], motion) for motion in train]
    size, entry, found = drawn.size, drawn.entry(drawn.size), 0.0
    for _ in range(MOST_PASSAGES):
        entry = drawn.entry(size)
        foreseen = foreseen_strength(robot, entry, plain, NOISE_STD[arm])
        if foreseen is None:
            foreseen, _ = strength(robot, [entry], [passage(robot, [entry], m) for m in train], NOISE_STD[arm])
        found = foreseen
        if abs(found / wanted - 1.0) < CLOSE_ENOUGH:
            break
        size = _resized(drawn, size, wanted, found)
    return entry, found


def _resized(drawn: Drawn, size: float, wanted: float, found: float) -> float:
    """The size at which s should be what is wanted, rounded as a person would write it."""
    factor = np.clip((wanted / max(found, 1e-6)) ** (1.0 / drawn.power), 0.02, 20.0)
    return float(f"{np.sign(size) * max(abs(size) * factor, drawn.smallest):.3g}")


def _ground(arm: str, motion_seed: int, joint: int) -> Ground:
    """What an effect's draw needs to know of the joint."""
    robot = arm_named(arm)
    train, _ = campaign(robot, motion_seed)
    passages = [passage(robot, [], motion) for motion in train]
    position = np.concatenate([each.position[:, joint] for each in passages])
    torque = np.concatenate([each.torque[:, joint] for each in passages])
    return Ground(
        robot,
        joint,
        NOISE_STD[arm][joint],
        float(torque.std()),
        float(position.min()),
        float(position.max()),
        max(len(motion.setpoints) for motion in train) / RATE_HZ,
    )


def _recorded(
    arm: str,
    motion_seed: int,
    kind: str,
    truth: tuple[Drawn, ...],
    entries: tuple[Entry, ...],
    found: float,
    seed: int,
    states_friction: bool,
    noise: dict[str, object],
) -> Trial:
    robot = arm_named(arm)
    rng = np.random.default_rng([seed, 9])
    every = int(noise.pop("every", 1))  # type: ignore[call-overload]
    periods = bool(noise.pop("states_periods", True))
    simulated = bool(noise.pop("simulated", False))
    sensors = Noise(NOISE_STD[arm], **noise)  # type: ignore[arg-type]
    made: list[list[Recording]] = []
    for motions in campaign(robot, motion_seed, kind):
        passages = passages_of(robot, entries, motions, simulated=simulated)
        made.append(
            [
                recording(m, p, entries, sensors, rng, every=every, states_periods=periods)
                for m, p in zip(motions, passages, strict=True)
            ]
        )
    stripped = without_truth(robot, states_friction=states_friction)
    return Trial(truth, entries, found, stripped, made[0], made[1], sensors)


def passages_of(robot: Robot, entries: Sequence[Entry], motions: Sequence[Motion], *, simulated: bool) -> list[Passage]:
    """All motions under the same effects: simulated, or where a law of the motion will do, along those without."""
    made = []
    for motion in motions:
        along = None if simulated else with_law(robot, physical(entries), passage(robot, [], motion))
        made.append(passage(robot, entries, motion) if along is None else along)
    return made
