"""One trial: an arm with something concealed, its recordings, and afterwards the truth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from concealed.arms import NOISE_STD, arm_named, without_truth
from concealed.effects import CATALOGUE, EVENTS, Drawn, Ground
from concealed.forms import FORMS, form_torque
from concealed.forward import Entry, Passage, passage, physical
from concealed.laws import with_law
from concealed.motions import RATE_HZ, Asked, campaign
from concealed.sensing import Noise, recording
from concealed.strength import foreseen_strength, strength
from concealed.unknown import UNKNOWN
from service.recording import Recording
from service.robot import Robot

Array = NDArray[np.float64]

DEVELOPMENT_SEEDS = range(10_000)
"""Seeds that may be looked at while the diagnosis is being made; those from a million are for reports only."""

CLOSE_ENOUGH = 0.12
"""Relative error of s that is accepted."""

MOST_PASSAGES = 4


@dataclass(frozen=True, eq=False)
class Concealed:
    """What an arm conceals: effects of a scenario file, and torque that no scenario has.

    truth : tuple of Drawn
        the effects; none on a sound arm
    entries : tuple of dict
        as in a scenario file
    strength : float
        s of all together
    joint : int
        at which `disturbance` acts
    disturbance : callable or None
        the torque (N,) that a joint needs beside along a passage
    """

    truth: tuple[Drawn, ...] = ()
    entries: tuple[Entry, ...] = ()
    strength: float = 0.0
    joint: int = 0
    disturbance: Callable[[Passage], Array] | None = None

    def passages(self, robot: Robot, motions: Sequence[Asked], *, simulated: bool = False) -> list[Passage]:
        """All motions under what is concealed: simulated, or along those without where a law of the motion will do."""
        return [self._disturbed(self._passage(robot, motion, simulated)) for motion in motions]

    def _passage(self, robot: Robot, motion: Asked, simulated: bool) -> Passage:
        along = None if simulated else with_law(robot, physical(self.entries), passage(robot, [], motion))
        return passage(robot, self.entries, motion) if along is None else along

    def _disturbed(self, plain: Passage) -> Passage:
        if self.disturbance is None:
            return plain
        torque = plain.torque.copy()
        torque[:, self.joint] += self.disturbance(plain)
        return replace(plain, torque=torque)


@dataclass(frozen=True, eq=False)
class Trial:
    """What was concealed, and what was recorded.

    arm : str
        its name
    concealed : Concealed
        the truth
    robot : Robot
        without a trace of the truth
    train, held_out : list of Recording
        noisy
    noise : Noise
        of the sensors
    every : int
        the logger keeps every so many samples
    """

    arm: str
    concealed: Concealed
    robot: Robot
    train: list[Recording]
    held_out: list[Recording]
    noise: Noise
    every: int = 1

    @property
    def truth(self) -> tuple[Drawn, ...]:
        return self.concealed.truth

    @property
    def strength(self) -> float:
        return self.concealed.strength

    def recorded(self, motion: Asked, seed: int) -> Recording:
        """One motion more of the same arm, seen by the same sensors."""
        (made,) = self.concealed.passages(arm_named(self.arm), [motion])
        rng = np.random.default_rng([seed, 11])
        return recording(motion, made, self.concealed.entries, self.noise, rng, every=self.every)


def null_trial(arm: str, motion_seed: int, seed: int, *, states_friction: bool = True, **noise: object) -> Trial:
    """Nothing concealed."""
    return _recorded(arm, motion_seed, "rich", Concealed(), seed, states_friction, noise)


def effect_trial(
    arm: str,
    effect: str,
    joint: int,
    wanted: float,
    *,
    motion_seed: int,
    seed: int,
    motion: str = "rich",
    states_friction: bool = True,
    **noise: object,
) -> Trial:
    """One effect at one joint with a wanted s."""
    concealed = _effects(arm, [(effect, joint)], wanted, motion_seed, seed)
    return _recorded(arm, motion_seed, motion, concealed, seed, states_friction, noise)


def several_trial(
    arm: str, places: Sequence[tuple[str, int]], wanted: float, *, motion_seed: int, seed: int, **noise: object
) -> Trial:
    """Several effects, each of the wanted s alone."""
    concealed = _effects(arm, places, wanted, motion_seed, seed)
    return _recorded(arm, motion_seed, "rich", concealed, seed, True, noise)


def unknown_trial(
    arm: str, law: str, joint: int, wanted: float, *, motion_seed: int, seed: int, **noise: object
) -> Trial:
    """Something at one joint that no catalogue has, with a wanted s."""

    def torque(plain: Passage, size: float) -> Array:
        return size * UNKNOWN[law](plain, joint, np.random.default_rng([seed, 3]))

    concealed = _law(arm, torque, joint, ("unknown",), wanted, motion_seed)
    return _recorded(arm, motion_seed, "rich", concealed, seed, True, noise)


def form_trial(
    arm: str, form: str, joint: int, wanted: float, *, motion_seed: int, seed: int, **noise: object
) -> Trial:
    """An effect of a family that the catalogue has, under another formula, with a wanted s."""
    ground = _ground(arm, motion_seed, joint)

    def torque(plain: Passage, size: float) -> Array:
        return form_torque(form, plain, ground, size, seed)

    concealed = _law(arm, torque, joint, FORMS[form].names, wanted, motion_seed)
    return _recorded(arm, motion_seed, "rich", concealed, seed, True, noise)


def _effects(arm: str, places: Sequence[tuple[str, int]], wanted: float, motion_seed: int, seed: int) -> Concealed:
    """Effects of the catalogue, each drawn from its own stream of random numbers."""
    truth, entries, found = [], [], []
    for number, (effect, joint) in enumerate(places):
        drawn = {**CATALOGUE, **EVENTS}[effect](
            _ground(arm, motion_seed, joint), np.random.default_rng([seed, 5 + number])
        )
        entry, size = sized(arm, drawn, wanted, motion_seed)
        truth.append(drawn)
        entries.append(entry)
        found.append(size)
    return Concealed(tuple(truth), tuple(entries), float(np.mean(found)))


def _law(
    arm: str,
    torque: Callable[[Passage, float], Array],
    joint: int,
    names: tuple[str, ...],
    wanted: float,
    motion_seed: int,
) -> Concealed:
    """A law of the motion at the size that has the wanted s."""
    robot = arm_named(arm)
    train, _ = campaign(robot, motion_seed)
    size, found, concealed = 1.0, 0.0, Concealed()
    for _ in range(MOST_PASSAGES):
        concealed = Concealed((), (), wanted, joint, lambda plain, size=size: torque(plain, size))
        found, _ = strength(robot, [], concealed.passages(robot, train), NOISE_STD[arm])
        if abs(found / wanted - 1.0) < CLOSE_ENOUGH:
            break
        size *= wanted / max(found, 1e-6)
    drawn = Drawn(lambda size: {}, size, 1.0, (joint,), names)
    return replace(concealed, truth=(drawn,), strength=found)


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
    return float(f"{np.sign(size) * np.clip(abs(size) * factor, drawn.smallest, drawn.largest):.3g}")


def _ground(arm: str, motion_seed: int, joint: int) -> Ground:
    """What an effect's draw needs to know of the joint."""
    robot = arm_named(arm)
    train, _ = campaign(robot, motion_seed)
    passages = [passage(robot, [], motion) for motion in train]
    lengths = [len(motion.setpoints) / RATE_HZ for motion in train]
    position = np.concatenate([each.position[:, joint] for each in passages])
    torque = np.concatenate([each.torque[:, joint] for each in passages])
    return Ground(
        robot,
        joint,
        NOISE_STD[arm][joint],
        float(torque.std()),
        float(position.min()),
        float(position.max()),
        max(lengths),
        min(lengths),
    )


def _recorded(
    arm: str,
    motion_seed: int,
    kind: str,
    concealed: Concealed,
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
    train, held_out = (
        [
            recording(motion, made, concealed.entries, sensors, rng, every=every, states_periods=periods)
            for motion, made in zip(motions, concealed.passages(robot, motions, simulated=simulated), strict=True)
        ]
        for motions in campaign(robot, motion_seed, kind)
    )
    stripped = without_truth(robot, states_friction=states_friction)
    return Trial(arm, concealed, stripped, train, held_out, sensors, every)
