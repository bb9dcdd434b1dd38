"""Joints share the links: what is wrong at one must not be told of the others."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import diagnose, document
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.fitting.lack_of_fit import lack_of_fit, without_spilled
from tauscope.diagnosis.fitting.regressor_noise import weightings_of_motion
from tauscope.diagnosis.noise.floor import with_pure_error

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
    """By the noise of repetitions a fit of the plain model leaves more at the others too, where nothing is wrong."""
    found = diagnosed(5)
    model = found.selection.nominal.model
    rows = with_pure_error(found.fitter.observations, model)
    assert rows is not None
    fitter = Fitter(rows.with_weightings(weightings_of_motion(rows, model)))
    fit = fitter.projected(model)
    plain = lack_of_fit(fit, fitter.observations, pure_error=True)
    assert plain.significant == [True, True, True]
    assert without_spilled(plain, fit, fitter, pure_error=True).significant == [False, True, False]


def test_a_diagnosis_names_the_joint_that_is_wrong_alone() -> None:
    found = diagnosed(5)
    assert found.misfit_before.significant == [False, True, False]
    assert [(each.effect, each.joint) for each in document(found).findings] == [("unknown", "joint2")]
