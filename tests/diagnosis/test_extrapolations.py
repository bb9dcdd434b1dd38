"""Held-out motion beyond training: which joints, and by what."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import few_or_all, only_effects
from identification.simulated import Array, SimulatedArm, paper_robot, simulate
from tauscope.diagnosis import diagnose, document
from tauscope.identification import Identification, identify
from tauscope.identification.warnings import extrapolations
from tauscope.recording import Recording
from tauscope_sim.motion import random_fourier_motion

NOISE = np.array([0.5, 0.3, 0.7])


def motion(seed: int, reach: float = 1.0) -> SimulatedArm:
    """Two periods whose amplitudes at joint 1 are a part of the usual ones."""
    own = random_fourier_motion(paper_robot().joints, np.random.default_rng(seed))
    scale = np.array([reach, 1.0, 1.0])[:, None]
    narrow = replace(own, cosine=scale * own.cosine, sine=scale * own.sine)
    return simulate(paper_robot(), seed=seed, periods=2, motion=narrow)


def recorded(arm: SimulatedArm, seed: int, noise: Array = NOISE, extra: Array | float = 0.0) -> Recording:
    rng = np.random.default_rng(seed)
    white = 2e-5 * rng.standard_normal(arm.exact.torque_exact.shape)
    return arm.recording(arm.white(noise, rng), white, extra_torque=extra, name=f"motion-{seed}")


def identified(train: Recording, held_out: Recording) -> Identification:
    return identify(paper_robot(), [train], [held_out])


def test_a_wider_and_faster_motion_is_told_with_its_joint() -> None:
    found = extrapolations(identified(recorded(motion(1, 0.3), 1), recorded(motion(1), 2)))
    assert set(found) == {0}
    assert "rad/s, in training at" in found[0]
    assert "rad, in training from" in found[0]


def test_motion_of_the_same_kind_is_no_extrapolation_however_loud_the_noise() -> None:
    """What training leaves uncertain of its own motion is noise."""
    found = identified(recorded(motion(1), 1, 40.0 * NOISE), recorded(motion(1), 2, 40.0 * NOISE))
    assert found.extrapolation is not None
    assert found.extrapolation.max() > 0.1
    assert extrapolations(found) == {}


@pytest.mark.parametrize("effects", few_or_all("cable_force", "joint_spring"))
def test_a_cable_that_only_held_out_motion_reaches_is_inconclusive(effects: Sequence[str] | None) -> None:
    """Training cannot name it, and its error may as well be that of parameters which training leaves open."""
    wide = motion(2)
    pull = np.zeros_like(wide.exact.torque_exact)
    pull[:, 0] = -60.0 * np.maximum(np.abs(wide.exact.exact.position[:, 0]) - 1.0, 0.0)
    with only_effects(effects):
        found = diagnose(paper_robot(), [recorded(motion(1, 0.3), 1)], [recorded(wide, 2, extra=pull)])
    told = document(found)
    assert told.verdict == "inconclusive"
    assert "extrapolation" in {each.code for each in told.warnings}
    assert told.next_experiment is not None
    assert "training lacks motion that held-out recordings have (joint1: " in told.next_experiment.why
