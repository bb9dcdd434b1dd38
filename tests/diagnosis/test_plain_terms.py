"""Nominal terms that a given model lacks: findings where the recordings show them, of the size that they have."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import sound_arm
from diagnosis.made_up_findings import finding, form
from identification.simulated import paper_robot
from tauscope.diagnosis import Diagnosis
from tauscope.diagnosis.findings.plain import _without, states_friction, undeclared_offsets, with_plain_terms
from tauscope.diagnosis.model.extended import move_model
from tauscope.effects.joint_spring import JointSpring
from tauscope.robot import FrictionCoefficients

JOINT = 1


def of_size(term: str, value: float, joint: int = JOINT) -> Diagnosis:
    """The sound arm as if one nominal parameter had come out otherwise."""
    sound = sound_arm()
    fit, place = sound.selection.fit, place_of(sound, term, joint)
    parameters = fit.model.parameters.copy()
    parameters[place] = value
    other = replace(fit, model=replace(fit.model, parameters=parameters))
    return replace(sound, selection=replace(sound.selection, fit=other))


def place_of(diagnosis: Diagnosis, term: str, joint: int = JOINT) -> int:
    place = diagnosis.selection.fit.model.structure.coefficient(joint, term)
    assert place is not None
    return place


@pytest.mark.parametrize(("term", "effect"), [("stiction", "coulomb_friction"), ("viscous", "viscous_friction")])
def test_friction_that_the_model_lacks_is_a_finding_of_its_size(term: str, effect: str) -> None:
    sound = sound_arm()
    (found,) = with_plain_terms(sound, [(JOINT, term)]).findings
    place = place_of(sound, term)
    value = sound.selection.fit.model.parameters[place]
    variance = sound.selection.fit.covariance[place, place]
    assert found.place == (effect, JOINT)
    assert found.terms[0].coefficients.tolist() == [value]
    assert found.covariances[0][0, 0] == pytest.approx(variance)
    assert found.gain == pytest.approx(value**2 / variance)
    assert found.confirmed
    assert not found.in_model
    assert found.probability > 0.99
    assert found.before.train[JOINT] > found.after.train[JOINT]


def test_what_may_as_well_be_zero_is_none() -> None:
    sound = sound_arm()
    place = place_of(sound, "viscous")
    error = float(np.sqrt(sound.selection.fit.covariance[place, place]))
    assert not with_plain_terms(of_size("viscous", 0.0), [(JOINT, "viscous")]).findings
    assert not with_plain_terms(of_size("viscous", 1.5 * error), [(JOINT, "viscous")]).findings


def test_what_held_out_motion_shows_with_the_other_sign_is_tentative() -> None:
    truth = sound_arm().selection.fit.model.parameters[place_of(sound_arm(), "viscous")]
    found = with_plain_terms(of_size("viscous", -truth), [(JOINT, "viscous")])
    assert not found.findings
    assert [each.place for each in found.tentative] == [("viscous_friction", JOINT)]


def test_without_held_out_motion_nothing_confirms_it() -> None:
    alone = replace(sound_arm(), held_out=None)
    (found,) = with_plain_terms(alone, [(JOINT, "viscous")]).findings
    assert found.confirmed is None


def test_the_constant_of_a_spring_is_the_springs_own() -> None:
    """A spring at rest elsewhere pushes at zero; at another joint a constant is a finding."""
    beside = replace(of_size("offset", 1.0), findings=(finding(form(JointSpring, JOINT), [0.6]),))
    assert with_plain_terms(beside, [(JOINT, "offset")]).findings == beside.findings
    elsewhere = replace(of_size("offset", 1.0), findings=(finding(form(JointSpring, 0), [0.6]),))
    named = {each.place for each in with_plain_terms(elsewhere, [(JOINT, "offset")]).findings}
    tentative = {each.place for each in with_plain_terms(elsewhere, [(JOINT, "offset")]).tentative}
    assert ("torque_offset", JOINT) in named | tentative


def test_only_a_file_that_states_friction_lacks_constants() -> None:
    silent = replace(paper_robot(), model=replace(paper_robot().model, friction=None))
    stating = replace(silent, model=replace(silent.model, friction=(FrictionCoefficients(),) * 3))
    assert not states_friction(silent)
    assert states_friction(stating)
    sound = sound_arm()
    for robot, expected in ((silent, []), (stating, [(joint, "offset") for joint in range(3)])):
        own = replace(sound, identification=replace(sound.identification, robot=robot))
        assert list(undeclared_offsets(own)) == expected


def test_without_a_term_the_rows_are_worse_by_its_share_and_the_others_move() -> None:
    """In least squares the energy grows by c² over the variance of c; nothing else is held."""
    sound = sound_arm()
    fit, place = sound.fitter.projected(sound.selection.fit.model), place_of(sound, "viscous")
    fit = replace(fit, model=move_model(fit.model, fit.projection.step))
    without = _without(fit, place)
    assert without.parameters[place] == 0.0
    expected = fit.model.parameters[place] ** 2 / fit.covariance[place, place]
    left, before = (
        sum(float(rows @ rows) for rows in sound.fitter.white_residual(model)) for model in (without, fit.model)
    )
    grown = left - before
    assert 0.8 * expected < grown < 1.2 * expected
    assert np.abs(np.delete(without.parameters - fit.model.parameters, place)).max() > 1e-3
