"""At a joint whose recorded torque is scaled, other effects are told as large as the arm has them."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import Diagnosis, diagnose, document
from tauscope.diagnosis.findings.finding import Finding
from tauscope.diagnosis.model.extended import ExtendedModel, move_model, with_terms
from tauscope.diagnosis.model.residual import predicted_rows
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.model.torque_scale import covariance_on_the_arm, on_the_arm
from tauscope.effects import possible_effects

pytestmark = pytest.mark.slow

JOINT, GAIN, SIZE = 1, 1.3, 0.8


def scaled_teeth(arm: SimulatedArm, rigid: Array) -> Array:
    """Cogging, and a torque constant that is wrong: both, less what is there without."""
    q, torque = arm.exact.exact.position[:, JOINT], arm.exact.torque_exact[:, JOINT]
    return at_joint(JOINT, GAIN * (torque + SIZE * np.sin(9.0 * q + 0.5)) - torque)


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    rng = np.random.default_rng(8)
    return diagnose(paper_robot(), recordings((1, 2), scaled_teeth, rng))


def term(diagnosis: Diagnosis, effect: str, joint: int, *coefficients: float) -> Term:
    form = next(each for each in possible_effects(diagnosis.setting) if (each.id, each.joint) == (effect, joint))
    return Term(form, form.grid[0], np.array(coefficients))


@pytest.fixture(scope="module")
def scaled(diagnosis: Diagnosis) -> ExtendedModel:
    """Two effects beside the scale, one at another joint."""
    terms = [
        term(diagnosis, "load_dependent_friction", JOINT, 0.2),
        term(diagnosis, "torque_gain_error", JOINT, GAIN - 1.0),
        term(diagnosis, "cable_force", JOINT, 4.0),
        term(diagnosis, "joint_spring", 2, 5.0),
    ]
    return with_terms(diagnosis.selection.nominal.model, terms)


def test_the_recorded_torque_is_the_arms_own_times_the_scale(diagnosis: Diagnosis, scaled: ExtendedModel) -> None:
    piece = diagnosis.fitter.observations.pieces[0]
    own = with_terms(
        scaled, [on_the_arm(scaled, each) for each in scaled.terms if each.effect.id != "torque_gain_error"]
    )
    factor = np.array([1.0, GAIN, 1.0])[:, None]
    # The scale's column has less of the positions' noise in it than the plain model's own torque.
    np.testing.assert_allclose(predicted_rows(scaled, piece), factor * predicted_rows(own, piece), atol=1e-3)


def test_the_covariance_is_that_of_the_quotient(scaled: ExtendedModel) -> None:
    """Against differences of the quotient itself."""
    root = np.random.default_rng(2).normal(size=(scaled.size, scaled.size))
    step, place = 1e-6, 2
    slopes = np.zeros((1, scaled.size))
    for number, own in enumerate(scaled.term_places()):
        moved = list(scaled.terms)
        moved[number] = replace(moved[number], coefficients=moved[number].coefficients + step)
        changed = with_terms(scaled, moved)
        before, after = (on_the_arm(each, each.terms[place]).coefficients[0] for each in (scaled, changed))
        slopes[0, own.start] = (after - before) / step
    found = covariance_on_the_arm(scaled, place, root @ root.T)
    assert found[0, 0] == pytest.approx((slopes @ root @ root.T @ slopes.T)[0, 0], rel=1e-4)


def test_nothing_is_named_that_is_not_there(diagnosis: Diagnosis) -> None:
    """The cogging is a hundred times the noise: what it leaves at its joint is no delay, and no play.

    Beside it the gain may be taken for an error of its formula; then nothing else is called what the gain explains.
    """
    found = {each.place for each in diagnosis.findings}
    assert ("cogging", JOINT) in found
    assert found <= {("cogging", JOINT), ("torque_gain_error", JOINT)}


def test_cogging_is_told_as_large_as_it_is(diagnosis: Diagnosis) -> None:
    teeth = term(diagnosis, "cogging", JOINT, 0.5, 0.5)
    at_nine = replace(teeth, shape=np.array([9.0]))
    terms = [term(diagnosis, "torque_gain_error", JOINT, 0.1), at_nine]
    fit = diagnosis.fitter.projected(with_terms(diagnosis.selection.nominal.model, terms))
    fit = replace(fit, model=move_model(fit.model, fit.projection.step))
    covariance = covariance_on_the_arm(fit.model, 1, fit.covariance)
    found = Finding((fit.model.terms[1],), (covariance,), 1e3, 0.9, diagnosis.before, diagnosis.after)
    told = document(replace(diagnosis, selection=replace(diagnosis.selection, fit=fit), findings=(found,)))
    size = next(each for each in told.findings[0].parameters if each.name == "amplitude")
    assert size.value == pytest.approx(SIZE, abs=3.0 * size.std)
    assert size.std < 0.02 * SIZE
