"""One trial: an arm with something concealed, its recordings, and afterwards the truth."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from concealed.generator.arms import arm_named, is_dry, noise_std, without_truth
from concealed.generator.concealment import Concealed, concealed_effects, concealed_unknown
from concealed.generator.effects import Drawn
from concealed.generator.motions import Asked, campaign
from concealed.generator.sensing import Noise, recording
from tauscope.recording import Recording
from tauscope.robot import Robot


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


def recorded_trial(
    arm: str,
    concealed: Concealed,
    *,
    motion_seed: int,
    seed: int,
    motion: str = "rich",
    states_friction: bool = True,
    every: int = 1,
    states_periods: bool = True,
    simulated: bool = False,
    **noise: Any,
) -> Trial:
    """The recordings of an arm that conceals something: every motion of a campaign, seen by sensors with some noise."""
    robot, sensors = arm_named(arm), Noise(noise_std(arm), **noise)
    rng = np.random.default_rng([seed, 9])
    train, held_out = (
        [
            recording(motion, made, concealed.entries, sensors, rng, every=every, states_periods=states_periods)
            for motion, made in zip(motions, concealed.passages(robot, motions, simulated=simulated), strict=True)
        ]
        for motions in campaign(robot, motion_seed, motion)
    )
    stripped = without_truth(robot, states_friction=states_friction and not is_dry(arm))
    return Trial(arm, concealed, stripped, train, held_out, sensors, every)


def null_trial(arm: str, motion_seed: int, seed: int, **recorded: Any) -> Trial:
    """Nothing concealed."""
    return recorded_trial(arm, Concealed(), motion_seed=motion_seed, seed=seed, **recorded)


def effect_trial(
    arm: str, effect: str, joint: int, wanted: float, *, motion_seed: int, seed: int, **recorded: Any
) -> Trial:
    """One effect at one joint with a wanted s."""
    return several_trial(arm, [(effect, joint)], wanted, motion_seed=motion_seed, seed=seed, **recorded)


def several_trial(
    arm: str, places: Sequence[tuple[str, int]], wanted: float, *, motion_seed: int, seed: int, **recorded: Any
) -> Trial:
    """Several effects, each of the wanted s alone."""
    concealed = concealed_effects(arm, places, wanted, motion_seed=motion_seed, seed=seed)
    return recorded_trial(arm, concealed, motion_seed=motion_seed, seed=seed, **recorded)


def unknown_trial(
    arm: str, law: str, joint: int, wanted: float, *, motion_seed: int, seed: int, **recorded: Any
) -> Trial:
    """Something at one joint that no catalogue has, with a wanted s."""
    concealed = concealed_unknown(arm, law, joint, wanted, motion_seed=motion_seed, seed=seed)
    return recorded_trial(arm, concealed, motion_seed=motion_seed, seed=seed, **recorded)
