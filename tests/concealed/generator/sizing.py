"""The size at which something shows with a wanted strength s on rich motion."""

from collections.abc import Callable
from math import sqrt

import numpy as np

from concealed.generator.arms import NOISE_STD, arm_named
from concealed.generator.effects import Drawn
from concealed.generator.forward import Entry, passage
from concealed.generator.motions import campaign
from concealed.generator.strength import foreseen_strength, strength

CLOSE_ENOUGH = 0.12
"""Relative error of s that is accepted."""

MOST_LOOKS = 4
"""Sizes that are tried before the last of them is taken."""


def sized(arm: str, drawn: Drawn, wanted: float, motion_seed: int) -> tuple[Entry, float]:
    """The effect's entry at a wanted s, and the s that it has."""
    robot, noise = arm_named(arm), NOISE_STD[arm]
    train, _ = campaign(robot, motion_seed)
    plain = [passage(robot, [], motion) for motion in train]

    def foreseen(size: float) -> float | None:
        return foreseen_strength(robot, drawn.entry(size), plain, noise)

    def simulated(size: float, motions: int) -> float:
        entry = drawn.entry(size)
        made = [passage(robot, [entry], motion) for motion in train[:motions]]
        return strength(robot, [entry], made, noise)[0]

    def shown(size: float) -> float:
        told = foreseen(size)
        return simulated(size, len(train)) if told is None else told

    guess = drawn.size
    if foreseen(guess) is None:  # the first motion alone tells roughly, in a third of the time that all take
        part = len(train[0].setpoints) / sum(len(motion.setpoints) for motion in train)
        guess, _ = tuned(lambda size: simulated(size, 1), wanted * sqrt(part), guess, drawn)
    size, found = tuned(shown, wanted, guess, drawn)
    return drawn.entry(size), found


def tuned(shown: Callable[[float], float], wanted: float, guess: float, drawn: Drawn) -> tuple[float, float]:
    """A size of which `shown` says that it has the wanted s, as nearly as its bounds allow, and the s that it has."""
    size, found = guess, shown(guess)
    for _ in range(MOST_LOOKS - 1):
        following = _resized(drawn, size, wanted, found)
        if abs(found / wanted - 1.0) < CLOSE_ENOUGH or following == size:
            break
        size, found = following, shown(following)
    return size, found


def _resized(drawn: Drawn, size: float, wanted: float, found: float) -> float:
    """The size at which s should be what is wanted, rounded as a person would write it."""
    factor = np.clip((wanted / max(found, 1e-6)) ** (1.0 / drawn.power), 0.02, 20.0)
    return float(f"{np.sign(size) * np.clip(abs(size) * factor, drawn.smallest, drawn.largest):.3g}")
