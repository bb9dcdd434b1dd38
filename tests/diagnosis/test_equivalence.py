"""Effects that data cannot tell apart: columns of hand-made likeness, and friction that cannot drive."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, recordings
from diagnosis.test_effect_columns import setting
from identification.simulated import Array, SimulatedArm, paper_robot
from service.diagnosis import diagnose
from service.diagnosis.catalogue import possible_effects
from service.diagnosis.catalogue.nonlinear_viscous import NonlinearViscous
from service.diagnosis.choice import driving, outsized
from service.diagnosis.diagnosed import Diagnosis
from service.diagnosis.equivalence import equivalents
from service.diagnosis.model import with_terms
from service.diagnosis.screening import Candidate
from service.diagnosis.table import fitted_option

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
    forms = [each for each in possible_effects(setting()) if isinstance(each, NonlinearViscous)]
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


def test_plain_friction_never_drives_beside_an_effect(diagnosis: Diagnosis) -> None:
    for candidate in candidates(diagnosis, "nonlinear_viscous") + candidates(diagnosis, "stribeck_friction"):
        option = fitted_option(candidate, diagnosis.selection.nominal, diagnosis.fitter)
        if not outsized(option, diagnosis.screen.observations):
            assert not driving(option.fit) - driving(diagnosis.selection.nominal)


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
