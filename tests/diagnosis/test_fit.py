"""The columns of an extended model are the slopes of what it leaves."""

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
