"""The fit of everything at once: its columns are the slopes of what it leaves."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import at_joint, only_effects, recordings
from identification.simulated import Array, SimulatedArm, paper_robot
from tauscope.diagnosis import diagnose
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.effects import possible_effects

JOINT, SIZE, SPEED = 1, 2.5, 0.3
STEP = 1e-3


def stribeck(arm: SimulatedArm, rigid: Array) -> Array:
    """Friction that rises towards rest by more than plain friction has."""
    v = arm.exact.exact.velocity[:, JOINT]
    return at_joint(JOINT, SIZE * 2.0 / np.pi * np.arctan(500.0 * v) * np.exp(-np.abs(v) / SPEED))


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    rng = np.random.default_rng(3)
    with only_effects(["stribeck_friction"]):
        return diagnose(paper_robot(), recordings((1,), stribeck, rng), recordings((11,), stribeck, rng))


def curve(diagnosis: Diagnosis) -> Term:
    """The Stribeck curve as it is."""
    (form,) = [
        each
        for each in possible_effects(diagnosis.setting)
        if each.id == "stribeck_friction" and each.joint == JOINT and each.grid[0, 1] == 1.0
    ]
    return Term(form, np.array([SPEED, 1.0]), np.array([SIZE]))


def test_columns_are_the_slopes_of_the_residual(diagnosis: Diagnosis) -> None:
    """K_v moves friction's step in the nominal model and in an effect that has it: each step must know of both."""
    nominal, fitter = diagnosis.selection.nominal.model, diagnosis.fitter
    model = with_terms(nominal, [curve(diagnosis)])
    place = model.constants.index((JOINT, "k_v"))

    def moved(change: float) -> Array:
        terms = list(model.structure.terms)
        terms[JOINT] = replace(terms[JOINT], k_v=model.constant(place) * np.exp(change))
        return fitter.white_residual(replace(model, structure=model.structure.with_terms(tuple(terms))))[JOINT]

    columns = fitter.columns(model)[JOINT]
    (column,) = columns.rows[columns.index == model.structure.size + place]
    slope = (moved(-STEP) - moved(STEP)) / (2.0 * STEP)
    assert np.linalg.norm(column - slope) < 0.01 * np.linalg.norm(slope)


def test_what_k_v_changes_of_an_effect_is_its_own_slope(diagnosis: Diagnosis) -> None:
    model = diagnosis.selection.nominal.model
    term = curve(diagnosis)
    signals = model.signals(diagnosis.fitter.observations.pieces[0])
    k_v, v = signals.steepness[JOINT], signals.velocity[JOINT]
    exact = SIZE * 2.0 / np.pi * k_v * v / (1.0 + (k_v * v) ** 2) * np.exp(-np.abs(v) / SPEED)
    found = with_terms(model, [term]).step_sensitivity(term, signals)
    np.testing.assert_allclose(found[0], exact, atol=1e-3 * SIZE)


@pytest.mark.parametrize(("speed", "size"), [(0.05, 0.5), (0.9, -1.0)])
def test_a_fit_ends_where_nothing_is_left_to_gain(diagnosis: Diagnosis, speed: float, size: float) -> None:
    """From either side of where a curve belongs, with friction that has first to find its own size and slopes."""
    nominal, fitter = diagnosis.selection.nominal.model, diagnosis.fitter
    far = replace(curve(diagnosis), shape=np.array([speed, 1.0]), coefficients=np.array([size]))
    found = fitter.fit(with_terms(nominal, [far]))
    assert found.energy - found.projection.energy < 0.1
    assert found.energy - fitter.fit(found.model).energy < 0.1


def test_energy_is_what_the_model_leaves_and_not_what_a_step_promises(diagnosis: Diagnosis) -> None:
    fitter = diagnosis.fitter
    begun = fitter.fit(with_terms(diagnosis.selection.nominal.model, [curve(diagnosis)]))
    left = sum(float(rows @ rows) for rows in fitter.white_residual(begun.model))
    _, of_prior = begun.model.prior()
    assert begun.energy == pytest.approx(left + float(of_prior @ of_prior), rel=1e-9)


def test_a_constant_at_its_limit_promises_nothing(diagnosis: Diagnosis) -> None:
    """What a slope beyond three times its start would explain is nothing that the model can."""
    nominal, fitter = diagnosis.selection.nominal.model, diagnosis.fitter
    place = nominal.constants.index((JOINT, "k_v"))
    terms = list(nominal.structure.terms)
    terms[JOINT] = replace(terms[JOINT], k_v=nominal.constant(place) / 20.0)
    unstated = tuple(None if at == place else stated for at, stated in enumerate(nominal.stated))
    flat = replace(nominal, structure=nominal.structure.with_terms(tuple(terms)), stated=unstated)
    found = fitter.fit(flat)
    assert found.model.constant(place) == pytest.approx(3.0 * flat.constant(place))
    assert found.projection.step[nominal.structure.size + place] == pytest.approx(0.0, abs=1e-9)
    assert found.energy == pytest.approx(found.projection.energy, abs=0.1)


def test_a_shape_at_its_bound_promises_nothing_and_is_not_known(diagnosis: Diagnosis) -> None:
    """A power of speed near one comes as near to a curve that falls with speed as its bound allows."""
    nominal, fitter = diagnosis.selection.nominal.model, diagnosis.fitter
    powers = [
        each for each in possible_effects(diagnosis.setting) if (each.id, each.joint) == ("nonlinear_viscous", JOINT)
    ]
    power = max(powers, key=lambda each: float(each.lower[0]))
    found = fitter.fit(with_terms(nominal, [Term(power, np.array([1.3]), np.array([1.0]))]))
    assert found.model.terms[0].shape == power.lower
    place = found.model.term_places()[0].stop - 1
    assert found.projection.step[place] == 0.0
    assert found.energy == pytest.approx(found.projection.energy, abs=0.1)
    assert found.covariance[place, place] > 0.0
