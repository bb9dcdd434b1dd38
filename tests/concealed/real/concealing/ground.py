"""A recorded set as effects are drawn for it: what each joint does there, and how much a nominal model leaves."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from concealed.real.concealing.nominal import Nominal, fit_nominal
from concealed.real.concealing.passage import Passage, passages_of
from concealed.real.concealing.recorded_sets import SETS
from tauscope.robot import Robot, read_robot

Array = NDArray[np.float64]

SMALLEST_MOTION = 1000
"""Encoder counts, or equal steps of the recorded angle, that a joint that moves goes through."""

SLIDING = 0.1
"""Speed, relative to the largest, beyond which a joint slides for sure: both ways where it reverses."""

BOTH_WAYS = 0.05
"""Share of the instants at which a joint that reverses slides each way at least: less is the start, or its noise."""


@dataclass(frozen=True, eq=False)
class Ground:
    """One set.

    folder : Path
        its files
    load : list of (N, n) float64
        rigid-body torque of the nominal model along every passage [Nm or N]
    low, high, speed, fastest, peak, effort : (n,) float64
        range, rms and 95 % speed, largest and rms torque of the training passages
    count : (n,) float64
        smallest step of the recorded position
    """

    folder: Path
    robot: Robot
    band_hz: float
    passages: list[Passage]
    nominal: Nominal
    load: list[Array]
    low: Array
    high: Array
    speed: Array
    fastest: Array
    peak: Array
    effort: Array
    count: Array

    @property
    def names(self) -> list[str]:
        return [joint.name for joint in self.robot.joints]

    @property
    def reach(self) -> Array:
        return self.high - self.low

    @property
    def training(self) -> list[Passage]:
        return [each for each in self.passages if not each.held_out]

    @property
    def duration(self) -> float:
        """A window in time lies within so long of every recording that is longer [s]."""
        longest = [max(each.time[-1] for each in self.passages if each.held_out is held) for held in (False, True)]
        return float(min(longest))

    def moves(self, joint: int) -> bool:
        return bool(self.reach[joint] > SMALLEST_MOTION * self.count[joint])

    def reverses(self, joint: int) -> bool:
        """Whether a joint slides both ways in training, so that friction is more than a constant."""
        velocity = np.concatenate([each.velocity[:, joint] for each in self.training])
        limit = SLIDING * np.abs(velocity).max()
        return self.moves(joint) and bool(min(np.mean(velocity > limit), np.mean(velocity < -limit)) > BOTH_WAYS)


@lru_cache(maxsize=len(SETS))
def ground_of_set(name: str) -> Ground:
    """One of the open sets."""
    return ground_of(SETS[name].folder, SETS[name].band_hz)


def ground_of(folder: Path, band_hz: float) -> Ground:
    """The recordings and the robot file of a folder."""
    robot = read_robot(folder / "robot.yaml")
    passages = passages_of(folder, robot, band_hz)
    nominal = fit_nominal(robot, passages, band_hz)
    training = [each for each in passages if not each.held_out]
    position, velocity, torque = (
        np.concatenate([getattr(each, name) for each in training]) for name in ("position", "velocity", "torque")
    )
    recorded = np.concatenate([each.recording.samples().position for each in training])
    return Ground(
        folder=folder,
        robot=robot,
        band_hz=band_hz,
        passages=passages,
        nominal=nominal,
        load=nominal.load(),
        low=position.min(axis=0),
        high=position.max(axis=0),
        speed=np.sqrt(np.mean(velocity**2, axis=0)),
        fastest=np.quantile(np.abs(velocity), 0.95, axis=0),
        peak=np.abs(torque).max(axis=0),
        effort=np.sqrt(np.mean(torque**2, axis=0)),
        count=np.array([_smallest_step(each) for each in recorded.T]),
    )


def _smallest_step(position: Array) -> float:
    """Step of the encoder: what lies most often between neighbours among all recorded angles; small where none does."""
    gaps = np.diff(np.unique(np.round(position, 9)))
    return float(np.quantile(gaps, 0.25)) if len(gaps) else 0.0
