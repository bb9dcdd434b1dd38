"""Joints share the links: what is wrong at one must not be told of the others."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from concealed.generator.trial import unknown_trial
from diagnosis.diagnosed_arm import at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import diagnose, document
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.lack_of_fit import lack_of_fit
from tauscope.diagnosis.noise.floor import FAR_ABOVE

pytestmark = pytest.mark.slow


def crossed(size: float) -> Callable[[SimulatedArm, Array], Array]:
    """Nothing of the catalogue, at the second joint alone [Nm]."""

    def torque(arm: SimulatedArm, rigid: Array) -> Array:
        q = arm.exact.exact.position
        return at_joint(1, size * np.sin(2.5 * q[:, 2]) * np.cos(1.7 * q[:, 0]))

    return torque


@cache
def diagnosed(seed: int) -> Diagnosis:
    rng = np.random.default_rng(seed)
    train, held_out = (recordings(motions, crossed(1.5), rng) for motions in ((1, 2), (11,)))
    return diagnose(paper_robot(), train, held_out)


def test_what_the_fit_spreads_is_told_of_the_joint_that_is_wrong() -> None:
    """With this noise the plain model leaves more than noise at the third joint too, where nothing is wrong."""
    found = diagnosed(5)
    plain = lack_of_fit(found.selection.nominal, found.fitter.observations, pure_error=found.pure_error)
    assert plain.significant == [False, True, True]
    assert found.misfit_before.significant == [False, True, False]
    assert [(each.effect, each.joint) for each in document(found).findings] == [("unknown", "joint2")]


@pytest.mark.parametrize("seed", [1, 5])
def test_what_explains_bent_links_is_not_named(seed: int) -> None:
    """A gain of the third joint makes up for links that were bent for the second: nothing of it is there."""
    assert diagnosed(seed).findings == ()


def test_the_noise_of_other_joints_stays_what_repetitions_differ_by() -> None:
    """However much is wrong at one: the fit that tells how much it is over them does not bend the links for it."""
    trial = unknown_trial("paper", "crossed_spring", 0, 400.0, motion_seed=31, seed=4)
    found = diagnose(trial.robot, trial.train, trial.held_out)
    wrong, *others = [own.over_repetitions for own in found.fitter.observations.noise]
    assert wrong > FAR_ABOVE
    assert others == [1.0, 1.0]
    assert found.mismatched == [True, False, False]
