"""Findings that only stand in for something else, where the tests of what is left say so."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import diagnose
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.lack_of_fit import lack_of_fit
from tauscope.diagnosis.selection.admission import Admission
from tauscope.diagnosis.selection.choice import Choice
from tauscope.diagnosis.selection.proxies import proxies
from tauscope.diagnosis.selection.pruning import without_proxies
from tauscope.diagnosis.selection.table import fitted_option
from tauscope.effects.external_contact import JointContact

pytestmark = pytest.mark.slow


def crossed(arm: SimulatedArm, rigid: Array) -> Array:
    """Nothing of the catalogue, at the second joint alone."""
    q = arm.exact.exact.position
    return at_joint(1, 1.5 * np.sin(2.5 * q[:, 2]) * np.cos(1.7 * q[:, 0]))


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    rng = np.random.default_rng(1)
    return diagnose(paper_robot(), recordings((1, 2), crossed, rng), recordings((11,), crossed, rng))


@pytest.mark.parametrize("effect", ["friction_coupling", "base_tilt"])
def test_a_likeness_that_leaves_most_of_what_is_wrong_is_none(diagnosis: Diagnosis, effect: str) -> None:
    """Also one that touches joints at which nothing was wrong: it spares them, and explains nothing there either."""
    nominal = diagnosis.selection.nominal
    assert diagnosis.misfit_before.significant == [False, True, False]
    likeness, *_ = [
        each
        for each in diagnosis.screen.candidates(nominal)
        if each.effect.id == effect and 1 in each.effect.touched(3) and each.effect.joint in (1, None)
    ]
    option = fitted_option(likeness, nominal, diagnosis.fitter)
    choice = Choice((option,), None, 0.0)
    assert proxies(nominal, option.fit, [choice], diagnosis.fitter.observations, pure_error=True) == [0]


def test_what_was_needed_beside_a_likeness_alone_goes_with_it(diagnosis: Diagnosis) -> None:
    """A likeness of many joints spoils some of them, and something else there makes up for it."""
    nominal, fitter = diagnosis.selection.nominal, diagnosis.fitter
    shown = diagnosis.screen.candidates(nominal)
    likeness, *_ = [each for each in shown if each.effect.id == "friction_coupling" and each.effect.joint == 1]
    beside, *_ = [each for each in shown if each.effect.id == "load_dependent_friction" and each.effect.joint == 0]
    first = fitted_option(likeness, nominal, fitter)
    second = fitted_option(beside, first.fit, fitter)
    choices = [Choice((first,), None, 0.0), Choice((second,), None, 0.0)]
    admission = Admission(diagnosis.screen, pure_error=True)
    fit, kept = without_proxies(nominal, second.fit, choices, fitter, admission)
    assert kept == []
    assert fit.model.terms == ()


def test_a_contact_that_explains_more_than_all_that_is_left_is_there_whatever_else_is(diagnosis: Diagnosis) -> None:
    """Where the noise is not known from repetitions, and the joint keeps more than noise besides."""
    nominal, rows = diagnosis.selection.nominal, diagnosis.fitter.observations
    contacts = [each for each in diagnosis.screen.candidates(nominal) if isinstance(each.effect, JointContact)]
    (contact,) = [each for each in contacts if each.effect.joint == 1]
    option = fitted_option(contact, nominal, diagnosis.fitter)
    left = float(np.sum(option.fit.projection.residual[1] ** 2))

    def dropped(gain: float) -> list[int]:
        choice = Choice((replace(option, gain=gain),), None, 0.0)
        return proxies(nominal, option.fit, [choice], rows, pure_error=False)

    assert dropped(0.99 * left) == [0]
    assert dropped(1.01 * left) == []


def bump(arm: SimulatedArm, rigid: Array) -> Array:
    """Nothing of the catalogue, and so much of it that the fit bends the links of all joints."""
    q = arm.exact.exact.position[:, 1]
    return at_joint(1, 0.8 * np.exp(-(((q - np.median(q)) / 0.25) ** 2)))


def test_a_joint_that_another_one_bends_does_not_answer_for_itself() -> None:
    """What explains its misfit is superfluous as soon as the other one's rows are left out."""
    rng = np.random.default_rng(1)
    diagnosis = diagnose(paper_robot(), recordings((1, 2), bump, rng), recordings((11,), bump, rng))
    nominal, fitter, admission = (
        diagnosis.selection.nominal,
        diagnosis.fitter,
        Admission(diagnosis.screen, pure_error=True),
    )
    assert lack_of_fit(nominal, fitter.observations, pure_error=True).significant == [True, True, True]
    assert diagnosis.misfit_before.significant == [False, True, False]
    shown = [each for each in diagnosis.screen.candidates(nominal) if each.effect.joint == 2]
    telling = sorted((each for each in shown if each.p_value() < admission.level), key=lambda each: -each.score)
    assert telling
    for each in telling[:3]:
        option = fitted_option(each, nominal, fitter)
        fit, kept = without_proxies(nominal, option.fit, [Choice((option,), None, 0.0)], fitter, admission)
        assert kept == [], f"{each.effect.id} explains joint 3, which only joint 2 bends"
        assert fit.model.terms == ()
