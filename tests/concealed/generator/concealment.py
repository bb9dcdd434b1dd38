"""What an arm conceals, as strong as wanted: effects of the catalogue, other formulas of them, laws of no catalogue."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from concealed.generator.arms import noise_std
from concealed.generator.effects import CATALOGUE, EVENTS, Drawn, Ground, flip_all, flip_one
from concealed.generator.forms import FORMS, form_torque
from concealed.generator.forward import Entry, Passage, passage, physical
from concealed.generator.laws import with_law
from concealed.generator.motions import Asked
from concealed.generator.rates import FINE, RATE_HZ
from concealed.generator.sizing import sized, tuned
from concealed.generator.strength import Reference, Sight, sight_of
from concealed.generator.unknown import UNKNOWN
from tauscope.errors import ScenarioError
from tauscope.robot import Robot
from tauscope_sim.effects.elastic_transmissions import Backlash, JointElasticity

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
        effects = physical(self.entries)
        if simulated or any(isinstance(effect, Backlash | JointElasticity) for effect in effects):
            return passage(robot, self.entries, motion)  # the drive feels its link: along another motion it is another
        along = with_law(robot, effects, passage(robot, [], motion))
        return passage(robot, self.entries, motion) if along is None else along

    def _disturbed(self, plain: Passage) -> Passage:
        if self.disturbance is None:
            return plain
        torque = plain.torque.copy()
        torque[:, self.joint] += self.disturbance(plain)
        return replace(plain, torque=torque)


def concealed_effects(
    arm: str,
    places: Sequence[tuple[str, int]],
    wanted: float,
    *,
    motion_seed: int,
    seed: int,
    reference: Reference | None = None,
) -> Concealed:
    """Effects of the catalogue at their joints, each of the wanted s alone and drawn from random numbers of its own.

    Raises
    ------
    ScenarioError
        where one would take more torque than all else that the arm does
    """
    truth, entries, found = [], [], []
    sight = sight_of(arm, motion_seed, reference or Reference())
    for number, (effect, joint) in enumerate(places):
        draw, rng = {**CATALOGUE, **EVENTS}[effect], np.random.default_rng([seed, 5 + number])
        drawn = draw(_ground(arm, sight, joint), rng)
        entry, shown = sized(sight, drawn, wanted)
        if not sight.is_plausible(entry):
            raise ScenarioError(f"{effect} of joint {joint + 1} shows with s = {wanted:g} only where no arm has it")
        truth.append(drawn)
        entries.append(entry)
        found.append(shown)
    return Concealed(tuple(truth), tuple(entries), float(np.mean(found)))


def concealed_signs(joint: int | None, joint_count: int) -> Concealed:
    """The torque of a joint, or of all joints, with the wrong sign."""
    drawn = flip_all(joint_count) if joint is None else flip_one(joint)
    joints = range(joint_count) if joint is None else [joint]
    entries = [{"effect": "torque_gain_error", "joint": one + 1, "gain": -1.0} for one in joints]
    return Concealed((drawn,), tuple(entries))


def concealed_unknown(arm: str, law: str, joint: int, wanted: float, *, motion_seed: int, seed: int) -> Concealed:
    """Something at one joint that no catalogue has."""

    def torque(plain: Passage, size: float) -> Array:
        return size * UNKNOWN[law](plain, joint, np.random.default_rng([seed, 3]))

    return _law(sight_of(arm, motion_seed, Reference()), torque, joint, ("unknown",), wanted)


def concealed_form(arm: str, form: str, joint: int, wanted: float, *, motion_seed: int, seed: int) -> Concealed:
    """An effect of a family that the catalogue has, under another formula."""
    sight = sight_of(arm, motion_seed, Reference())
    ground = _ground(arm, sight, joint)

    def torque(plain: Passage, size: float) -> Array:
        return form_torque(form, plain, ground, size, seed)

    return _law(sight, torque, joint, FORMS[form].names, wanted)


def _law(
    sight: Sight, torque: Callable[[Passage, float], Array], joint: int, names: tuple[str, ...], wanted: float
) -> Concealed:
    """A law of the motion at the size that has the wanted s."""
    drawn = Drawn(lambda size: {}, 1.0, 1.0, (joint,), names)
    unit = np.eye(sight.robot.joint_count)[joint]

    def shown(size: float) -> float:
        return sight.strength([torque(each, size)[:, None] * unit for each in sight.passages])[0]

    size, found = tuned(shown, wanted, drawn.size, drawn)
    return Concealed((drawn,), (), found, joint, lambda plain: torque(plain, size))


def _ground(arm: str, sight: Sight, joint: int) -> Ground:
    """What an effect's draw needs to know of the joint."""
    lengths = [len(each.position) / (FINE * RATE_HZ) for each in sight.passages]
    position = np.concatenate([each.position[:, joint] for each in sight.passages])
    torque = np.concatenate([each.torque[:, joint] for each in sight.passages])
    return Ground(
        sight.robot,
        joint,
        noise_std(arm)[joint],
        float(torque.std()),
        float(position.min()),
        float(position.max()),
        max(lengths),
        min(lengths),
    )
