"""The size at which something shows with a wanted strength s."""

from collections.abc import Callable

import numpy as np

from concealed.generator.effects import Drawn
from concealed.generator.forward import Entry
from concealed.generator.strength import Sight

CLOSE_ENOUGH = 0.12
"""Relative error of s that is accepted."""

MOST_LOOKS = 4
"""Sizes that are tried before the last of them is taken."""


def sized(sight: Sight, drawn: Drawn, wanted: float) -> tuple[Entry, float]:
    """The effect's entry at a wanted s, and the s that it has."""
    size, found = tuned(lambda size: sight.foreseen(drawn.entry(size)), wanted, drawn.size, drawn)
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
