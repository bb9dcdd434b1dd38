"""What an arm conceals, as strong as wanted: effects of the catalogue, other formulas of them, laws of no catalogue."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from concealed.generator.arms import NOISE_STD, arm_named
from concealed.generator.effects import CATALOGUE, EVENTS, Drawn, Ground
from concealed.generator.forms import FORMS, form_torque
from concealed.generator.forward import Entry, Passage, passage, physical
from concealed.generator.laws import with_law
from concealed.generator.motions import RATE_HZ, Asked, campaign
from concealed.generator.sizing import sized, tuned
from concealed.generator.strength import strength
from concealed.generator.unknown import UNKNOWN
from tauscope.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Concealed:
    """What an arm conceals: effects of a scenario file, and torque that no scenario has.

    truth : tuple of Drawn
        the effects; none on a sound arm
    entries : tuple of dict
        as in a scenario file
    strength : float
        s, the mean where there are several
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


def concealed_effects(
    arm: str, places: Sequence[tuple[str, int]], wanted: float, *, motion_seed: int, seed: int
) -> Concealed:
    """Effects of the catalogue at their joints, each of the wanted s alone and drawn from random numbers of its own."""
    truth, entries, found = [], [], []
    for number, (effect, joint) in enumerate(places):
        draw, rng = {**CATALOGUE, **EVENTS}[effect], np.random.default_rng([seed, 5 + number])
        drawn = draw(_ground(arm, motion_seed, joint), rng)
        entry, shown = sized(arm, drawn, wanted, motion_seed)
        truth.append(drawn)
        entries.append(entry)
        found.append(shown)
    return Concealed(tuple(truth), tuple(entries), float(np.mean(found)))


def concealed_unknown(arm: str, law: str, joint: int, wanted: float, *, motion_seed: int, seed: int) -> Concealed:
    """Something at one joint that no catalogue has."""

    def torque(plain: Passage, size: float) -> Array:
        return size * UNKNOWN[law](plain, joint, np.random.default_rng([seed, 3]))

    return _law(arm, torque, joint, ("unknown",), wanted, motion_seed)


def concealed_form(arm: str, form: str, joint: int, wanted: float, *, motion_seed: int, seed: int) -> Concealed:
    """An effect of a family that the catalogue has, under another formula."""
    ground = _ground(arm, motion_seed, joint)

    def torque(plain: Passage, size: float) -> Array:
        return form_torque(form, plain, ground, size, seed)

    return _law(arm, torque, joint, FORMS[form].names, wanted, motion_seed)


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
    drawn = Drawn(lambda size: {}, 1.0, 1.0, (joint,), names)

    def concealed(size: float) -> Concealed:
        return Concealed((drawn,), (), wanted, joint, lambda plain: torque(plain, size))

    def shown(size: float) -> float:
        return strength(robot, [], concealed(size).passages(robot, train), NOISE_STD[arm])[0]

    size, found = tuned(shown, wanted, drawn.size, drawn)
    return replace(concealed(size), strength=found)


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
