"""Recordings of the paper's arm with an effect written out here, never taken from the catalogue."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache

import numpy as np
import pytest
from _pytest.mark import ParameterSet

from identification.simulated import PAPER_NOISE, Array, SimulatedArm, paper_robot, simulate
from tauscope.diagnosis import Diagnosis, diagnose
from tauscope.effects import possible_effects
from tauscope.recording import Recording
from tauscope.robot import FrictionCoefficients

EffectTorque = Callable[[SimulatedArm, Array], Array]
"""From the exact motion and its rigid-body torque (N, n) to the effect's torque (N, n)."""

POSITION_NOISE = 2e-5


@cache
def motions(seeds: tuple[int, ...]) -> tuple[tuple[SimulatedArm, Array], ...]:
    """Exact motions of the paper's arm, two periods of ten seconds each, with their torque without friction."""
    robot = paper_robot()
    still = (FrictionCoefficients(),) * robot.joint_count
    pairs = []
    for seed in seeds:
        arm = simulate(robot, seed=seed, periods=2)
        pairs.append((arm, simulate(robot, seed=seed, periods=2, friction=still).exact.torque_exact))
    return tuple(pairs)


def recordings(seeds: tuple[int, ...], effect: EffectTorque | None, rng: np.random.Generator) -> list[Recording]:
    """What a logger leaves of these motions, noise of the paper's size drawn anew."""
    made = []
    for (arm, rigid), seed in zip(motions(seeds), seeds, strict=True):
        extra = 0.0 if effect is None else effect(arm, rigid)
        noise = POSITION_NOISE * rng.standard_normal(rigid.shape)
        made.append(arm.recording(arm.white(PAPER_NOISE, rng), noise, extra_torque=extra, name=f"motion-{seed}"))
    return made


def few_or_all(*ids: str) -> list[ParameterSet]:
    """What `only_effects` takes: a few effects in a quick test, and all in a whole proof."""
    return [pytest.param(ids, id="few effects"), pytest.param(None, id="whole catalogue", marks=pytest.mark.proof)]


@contextmanager
def only_effects(ids: Sequence[str] | None) -> Iterator[None]:
    """Diagnoses that look for these effects alone: to compare the whole catalogue takes most of a diagnosis' time."""
    if ids is None:
        yield
        return
    module = "tauscope.diagnosis.search.from_recordings"
    with pytest.MonkeyPatch.context() as patch:
        forms = [f"{module}.possible_effects", f"{module}.farther_effects"]
        patch.setattr(forms[0], lambda context: [each for each in possible_effects(context) if each.id in ids])
        patch.setattr(forms[1], lambda _: [])
        yield


@cache
def sound_arm() -> Diagnosis:
    """Of an arm that lacks nothing, with held-out motion."""
    rng = np.random.default_rng(0)
    with only_effects(["joint_spring"]):
        return diagnose(paper_robot(), recordings((1,), None, rng), recordings((11,), None, rng))


def at_joint(joint: int, torque: Array) -> Array:
    """Torque (N,) of one joint among three, (N, 3)."""
    whole = np.zeros((len(torque), 3))
    whole[:, joint] = torque
    return whole
