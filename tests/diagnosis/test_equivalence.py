"""Effects that data cannot tell apart: columns of hand-made likeness, and friction that cannot drive."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, recordings
from effects.piece_of_motion import context
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import diagnose
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.screening.screen import Candidate
from tauscope.diagnosis.selection.choice import Choice, Option, driving, is_physical, outsized
from tauscope.diagnosis.selection.confirmation import Confirmation
from tauscope.diagnosis.selection.equivalence import doubt, equivalents, probability_among, with_rivals
from tauscope.diagnosis.selection.selector import Selector
from tauscope.diagnosis.selection.table import fitted_option, turned_negative
from tauscope.effects import possible_effects
from tauscope.effects.nonlinear_viscous import NonlinearViscous

JOINT = 0


def drag(arm: SimulatedArm, rigid: Array) -> Array:
    """Drag that grows faster than speed, on the joint with the least of plain friction."""
    v = arm.exact.exact.velocity[:, JOINT]
    return at_joint(JOINT, 0.25 * np.sign(v) * np.abs(v) ** 1.7)


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    rng = np.random.default_rng(5)
    return diagnose(paper_robot(), recordings((1, 2), drag, rng), recordings((11,), drag, rng))


def candidates(diagnosis: Diagnosis, effect: str) -> list[Candidate]:
    shown = diagnosis.screen.candidates(diagnosis.selection.nominal)
    return [each for each in shown if each.effect.id == effect and each.effect.joint == JOINT]


def test_powers_of_speed_keep_away_from_the_model_s_own_line() -> None:
    """At a power of one, coefficients of any size cancel the viscous term."""
    forms = [each for each in possible_effects(context()) if isinstance(each, NonlinearViscous)]
    for form in forms:
        assert (form.lower > 1.0) | (form.upper < 1.0)
        assert form.lower <= form.grid.min()
        assert form.grid.max() <= form.upper


def test_what_two_effects_share_decides_whether_data_tell_them_apart(diagnosis: Diagnosis) -> None:
    """Beside itself an effect is nothing new; beside another joint's it is all there is."""
    nominal, screen = diagnosis.selection.nominal, diagnosis.screen
    (power,) = [c for c in candidates(diagnosis, "nonlinear_viscous") if c.shape[0] > 1.0]
    (ripple,) = candidates(diagnosis, "position_dependent_friction")
    option, other = (fitted_option(each, nominal, diagnosis.fitter) for each in (power, ripple))
    strong, same = replace(option, gain=1e4), replace(option, gain=100.0)
    assert equivalents(strong, [same], nominal, screen, 1.0) == [same]
    assert equivalents(strong, [replace(other, gain=100.0)], nominal, screen, 1.0) == []


def test_of_two_laws_of_speed_the_better_one_is_hardly_surer_for_being_better(diagnosis: Diagnosis) -> None:
    """No formula is exact: a thirtieth of what they explain says little between them, a ninth more; among other laws it
    says much."""
    nominal, screen = diagnosis.selection.nominal, diagnosis.screen
    (power,) = [c for c in candidates(diagnosis, "nonlinear_viscous") if c.shape[0] > 1.0]
    stribeck, ripple = (candidates(diagnosis, name)[0] for name in ("stribeck_friction", "position_dependent_friction"))
    best, like, unlike = (
        replace(fitted_option(each, nominal, diagnosis.fitter), gain=gain)
        for each, gain in ((power, 1000.0), (stribeck, 970.0), (ripple, 970.0))
    )
    assert like in equivalents(best, [like], nominal, screen, 1.0)
    assert equivalents(best, [unlike], nominal, screen, 1.0) == []
    behind = replace(like, gain=890.0)
    sure, unsure, likely = (
        probability_among(best.score, [each.score], [doubt(best, each, 1.0)]) for each in (unlike, like, behind)
    )
    assert sure == pytest.approx(0.999)
    assert 0.5 < unsure < 0.75
    assert 0.85 < likely < 0.95


def test_what_was_given_up_for_a_law_of_the_same_quantities_stays_beside_it(diagnosis: Diagnosis) -> None:
    nominal = diagnosis.selection.nominal
    names = ("nonlinear_viscous", "stribeck_friction", "position_dependent_friction")
    power, stribeck, ripple = (
        Choice((fitted_option(candidates(diagnosis, name)[0], nominal, diagnosis.fitter),), None, 0.0) for name in names
    )
    assert with_rivals(power, [stribeck, ripple]).options == (*power.options, *stribeck.options)
    assert with_rivals(ripple, [power, stribeck]).options == ripple.options


@pytest.mark.parametrize("confirmed", [True, False])
def test_an_alternative_that_held_out_recordings_refute_is_none(diagnosis: Diagnosis, confirmed: bool) -> None:
    """However well it explains the recordings that were used; one that they confirm takes the finding's place."""

    class Deciding(Selector):
        def confirmation(self, fit: Fit, option: Option) -> Confirmation:
            return Confirmation(0.0, 10.0 if confirmed else -10.0, 0.0, 0.0, 0.0)

    nominal = diagnosis.selection.nominal
    own, better = (
        replace(fitted_option(candidates(diagnosis, name)[0], nominal, diagnosis.fitter), gain=gain)
        for name, gain in (("position_dependent_friction", 100.0), ("nonlinear_viscous", 1000.0))
    )
    selector = Deciding(diagnosis.screen, diagnosis.fitter, None, pure_error=True)
    fit, choice = selector._exchanged(own.fit, Choice((own, better), None, 0.0), 0)
    assert choice.options == ((better, own) if confirmed else (own,))
    assert fit is choice.options[0].fit


def test_friction_that_has_not_risen_before_it_decays_is_no_stribeck_curve(diagnosis: Diagnosis) -> None:
    nominal = diagnosis.selection.nominal
    (candidate, *_) = candidates(diagnosis, "stribeck_friction")
    option = replace(fitted_option(candidate, nominal, diagnosis.fitter), gain=100.0)
    model = option.fit.model
    (term,), (k_v, decay) = model.terms, (50.0, 0.1)

    def with_curve(k_v: float, decay: float) -> Option:
        terms = list(model.structure.terms)
        terms[JOINT] = replace(terms[JOINT], k_v=k_v)
        curve = replace(term, shape=np.array([decay, *term.shape[1:]]), coefficients=np.abs(term.coefficients))
        whole = with_terms(replace(model, structure=model.structure.with_terms(tuple(terms))), [curve])
        return replace(option, fit=replace(option.fit, model=whole))

    assert is_physical(with_curve(k_v, decay), nominal)
    assert not is_physical(with_curve(k_v, 0.15 / k_v), nominal)


def test_plain_friction_never_drives_beside_an_effect(diagnosis: Diagnosis) -> None:
    for candidate in candidates(diagnosis, "nonlinear_viscous") + candidates(diagnosis, "stribeck_friction"):
        option = fitted_option(candidate, diagnosis.selection.nominal, diagnosis.fitter)
        if not outsized(option, diagnosis.screen.observations):
            assert not driving(option.fit) - driving(diagnosis.selection.nominal)


@pytest.mark.parametrize(("before", "after", "turned"), [(0.1, -4.0, True), (-0.1, -4.0, True), (-4.0, -5.0, False)])
def test_friction_that_was_as_good_as_none_may_not_drive_either(
    before: float, after: float, turned: bool, diagnosis: Diagnosis
) -> None:
    nominal = diagnosis.selection.nominal
    place = nominal.model.structure.coefficient(JOINT, "viscous")
    assert place is not None
    std = np.sqrt(nominal.covariance[place, place] * nominal.inflation())

    def with_viscous(standard_errors: float) -> Fit:
        parameters = np.array(nominal.model.parameters)
        parameters[place] = standard_errors * std
        return replace(nominal, model=replace(nominal.model, parameters=parameters))

    found = turned_negative(with_viscous(after), with_viscous(before))
    assert found == ({(JOINT, "viscous")} if turned else set())


def test_what_a_term_displaces_is_free_again_without_it(diagnosis: Diagnosis) -> None:
    nominal = diagnosis.selection.nominal
    (candidate, *_) = candidates(diagnosis, "position_dependent_friction")
    option = fitted_option(candidate, nominal, diagnosis.fitter)
    place = nominal.model.structure.coefficient(JOINT, "viscous")
    assert place is not None
    (term,) = option.fit.model.terms
    parameters = option.fit.model.parameters.copy()
    parameters[place] = 0.0
    start = with_terms(replace(option.fit.model, parameters=parameters), [replace(term, displaced=(place,))])
    held = diagnosis.fitter.fit(start)
    assert held.model.parameters[place] == pytest.approx(0.0, abs=1e-9)
    again = diagnosis.fitter.fit(with_terms(held.model, []))
    assert again.model.parameters[place] == pytest.approx(nominal.model.parameters[place], rel=0.02)
    assert again.energy == pytest.approx(nominal.energy, rel=2e-3)  # to where steps are no longer worth taking
    # What was held is as uncertain as if nothing had been.
    free = diagnosis.fitter.covariance(held)
    assert free[place, place] > 1e6 * held.covariance[place, place]
