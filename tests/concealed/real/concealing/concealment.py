"""One effect to conceal: what it does to a recording or a robot file at a given size, and what names it rightly."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from concealed.real.concealing.ground import Ground
from concealed.real.concealing.passage import Passage

Array = NDArray[np.float64]

Torque = Callable[[Passage, Array], Array]
"""Unit torque (N, n) of a law along a passage and its rigid-body torque (N, n)."""


@dataclass(frozen=True, eq=False)
class Concealment:
    """One effect, but for its size.

    kind : str
        of the list of kinds
    joint : int
        at which its size is measured, from 0
    labels : tuple of str
        ``effect@joint``, or ``effect`` for the whole arm: each is a right answer
    parameters : callable
        values that a finding should tell at a size, by the names that findings give them
    bounds : (float, float)
        sizes that are physical
    torque : callable or None
        unit torque, for laws that are proportional to the size
    report : callable or None
        recorded torque (N, n) of a passage at a size, for what happens to the torque channel
    rewrite : callable or None
        copies the robot's files into a folder with one value wrong by a size
    fixed : float or None
        size that is not searched: a sign
    window : callable or None
        where it happens at all, share (N,) of instants [s]
    constants : dict
        all that was drawn
    """

    kind: str
    joint: int
    labels: tuple[str, ...]
    parameters: Callable[[float], dict[str, float]]
    bounds: tuple[float, float]
    torque: Torque | None = None
    report: Callable[[Passage, float], Array] | None = None
    rewrite: Callable[[float, Path, Path], None] | None = None
    fixed: float | None = None
    window: Callable[[Array], Array] | None = None
    constants: Mapping[str, float] = field(default_factory=dict)

    def added(self, ground: Ground, size: float) -> list[Array]:
        """Torque (N, n) that it adds to every passage of the set as it was recorded."""
        if self.torque is not None:
            return [size * self.torque(each, load) for each, load in zip(ground.passages, ground.load, strict=True)]
        if self.report is not None:
            return [self.report(each, size) - each.torque for each in ground.passages]
        return [np.zeros_like(each.torque) for each in ground.passages]


def window_rows(concealment: Concealment, ground: Ground) -> list[NDArray[np.bool_]]:
    """Rows of every passage in which it happens."""
    found = []
    for grid in ground.nominal.grids:
        time = grid.time[grid.rows]
        found.append(np.ones(len(time), bool) if concealment.window is None else concealment.window(time) > 0.0)
    return found


def rms_left(ground: Ground, left: Sequence[Array], concealment: Concealment) -> float:
    """Rms of what a nominal model leaves, in units of the joint's plain residual, while it happens.

    At the effect's joint; of a wrong robot file, which acts on all, at the joint where that is most.
    """
    rows = window_rows(concealment, ground)
    there = np.concatenate([left[number][rows[number]] for number in ground.nominal.training])
    if not len(there):
        return 0.0
    multiples = np.sqrt(np.mean(there**2, axis=0)) / ground.nominal.scale
    return float(multiples[concealment.joint] if concealment.rewrite is None else multiples.max())
