"""Residual and columns of a model at once: against the residual worked out by itself, and against its differences."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnosed_arm import only_effects, recordings
from identification.simulated import Array, paper_robot
from tauscope.diagnosis import diagnose
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.fitting.white_columns import WhiteColumns
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.model.term import Term
from tauscope.effects import Effect, possible_effects

IDS = ("stribeck_friction", "load_dependent_friction", "torque_gain_error", "time_delay", "joint_spring", "base_tilt")


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    rng = np.random.default_rng(3)
    with only_effects([]):
        return diagnose(paper_robot(), recordings((1, 2), None, rng))


def any_term(effect: Effect, rng: np.random.Generator) -> Term:
    return Term(effect, effect.grid[len(effect.grid) // 2], rng.uniform(0.01, 0.03, len(effect.coefficients)))


def full(diagnosis: Diagnosis) -> ExtendedModel:
    """A model with effects of every kind at one joint and at all, and Θ that is not the best."""
    rng = np.random.default_rng(8)
    nominal = diagnosis.selection.nominal.model
    forms = [next(each for each in possible_effects(diagnosis.setting) if each.id == name) for name in IDS]
    moved = replace(nominal, parameters=nominal.parameters * rng.uniform(0.9, 1.1, nominal.structure.size))
    return with_terms(moved, [any_term(form, rng) for form in forms])


def test_the_residual_is_what_the_model_leaves_of_the_measured_torque(diagnosis: Diagnosis) -> None:
    observations, model = diagnosis.fitter.observations, full(diagnosis)
    found = WhiteColumns(observations).residual(model)
    for joint, rows in enumerate(residual_rows(model, observations)):
        (expected,) = observations.white(joint, rows)
        np.testing.assert_allclose(found[joint], expected, atol=1e-9 * np.abs(expected).max())


def test_load_is_the_torque_of_the_links_without_the_noise_of_their_inertia(diagnosis: Diagnosis) -> None:
    """A filtered sum is the sum of filtered columns; friction and what else a joint has are added as they are."""
    model = full(diagnosis)
    structure = model.structure
    links = np.where(np.arange(structure.size) < structure.base_count, model.parameters, 0.0)
    for piece in diagnosis.fitter.observations:
        whole, rigid = piece.prepared.predict_torque(structure, np.stack([model.parameters, links]))
        signals, load = model.signals(piece), piece.without_noise_of_inertia(rigid)
        np.testing.assert_allclose(signals.load, load, atol=1e-9 * np.abs(load).max())
        np.testing.assert_allclose(signals.torque, whole - rigid + load, atol=1e-9 * np.abs(whole).max())


def test_columns_are_the_differences_of_the_residual_in_every_parameter_of_the_links(diagnosis: Diagnosis) -> None:
    """A gain error at the first joint multiplies them, but for the noise that accelerations have in its own column."""
    white = WhiteColumns(diagnosis.fitter.observations)
    terms = [each for each in full(diagnosis).terms if each.effect.id in ("torque_gain_error", "joint_spring")]
    model = with_terms(full(diagnosis), terms)
    residual, columns = white.residual(model), white.all(model)
    for place in range(model.structure.base_count):
        step = np.eye(model.structure.size)[place]
        moved = white.residual(replace(model, parameters=model.parameters + step))
        for joint, own in enumerate(columns):
            expected = own.rows[own.index == place].sum(axis=0) if (own.index == place).any() else 0.0
            found = residual[joint] - moved[joint]
            assert np.linalg.norm(found - expected) <= 1e-4 * np.linalg.norm(expected) + 1e-6


@pytest.mark.parametrize("form", ["TorqueSaturation", "Clipping"])
def test_a_curve_that_bends_the_torque_bends_the_columns_of_the_links(diagnosis: Diagnosis, form: str) -> None:
    """Row by row: whitening mixes neighbours, so they are nearly the differences."""
    white = WhiteColumns(diagnosis.fitter.observations)
    effect = next(each for each in possible_effects(diagnosis.setting) if type(each).__name__ == form)
    assert effect.joint is not None
    model = with_terms(full(diagnosis), [Term(effect, effect.grid[1], np.ones(1))])
    residual, columns = white.residual(model)[effect.joint], white.all(model)[effect.joint]
    for place in columns.index[columns.index < model.structure.base_count]:
        step = 1e-3 * np.eye(model.structure.size)[place]
        moved = white.residual(replace(model, parameters=model.parameters + step))[effect.joint]
        found, expected = (residual - moved) / 1e-3, columns.rows[columns.index == place].sum(axis=0)
        assert np.linalg.norm(found - expected) <= 0.25 * np.linalg.norm(found) + 1e-6


def columns_of(effect: Effect, model: ExtendedModel, diagnosis: Diagnosis, *, as_term: bool) -> list[Array]:
    found = []
    for piece in diagnosis.fitter.observations:
        signals = model.signals_of_terms(piece) if as_term else model.signals(piece)
        found.append(effect.columns(signals, effect.grid[:2]))
    return found


def test_terms_that_need_no_parameters_have_the_same_columns_beside_any(diagnosis: Diagnosis) -> None:
    """Every form: with Θ and K_v that no signals were made for, as terms and with signals of their own."""
    nominal = diagnosis.selection.nominal.model
    for number, effect in enumerate(possible_effects(diagnosis.setting)):
        rng = np.random.default_rng(number)
        steeper = tuple(replace(each, k_v=each.k_v * rng.uniform(0.5, 2.0)) for each in nominal.structure.terms)
        parameters = nominal.parameters * rng.uniform(0.5, 2.0, nominal.structure.size)
        other = replace(nominal, structure=nominal.structure.with_terms(steeper), parameters=parameters)
        model = with_terms(other, [any_term(effect, rng)])
        found = columns_of(effect, model, diagnosis, as_term=True)
        expected = columns_of(effect, model, diagnosis, as_term=False)
        for one, two in zip(found, expected, strict=True):
            np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-12, err_msg=effect.id)


def test_columns_that_are_kept_are_those_that_would_be_made(diagnosis: Diagnosis) -> None:
    """One after the other: another Θ, another K_v, another shape, other coefficients, and the first again."""
    observations, model = diagnosis.fitter.observations, full(diagnosis)
    steeper = tuple(replace(each, k_v=1.2 * each.k_v) for each in model.structure.terms)
    curve, *others = model.terms
    assert curve.effect.id == "stribeck_friction"
    models = [
        model,
        replace(model, parameters=1.1 * model.parameters),
        replace(model, structure=model.structure.with_terms(steeper)),
        with_terms(model, [replace(curve, shape=1.05 * curve.shape), *others]),
        with_terms(model, [replace(each, coefficients=1.3 * each.coefficients) for each in model.terms]),
        model,
    ]
    keeping = WhiteColumns(observations)
    for each in models:
        fresh = WhiteColumns(observations)
        for one, two in zip(keeping.residual(each), fresh.residual(each), strict=True):
            np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-9)
        for found, expected in zip(keeping.all(each), fresh.all(each), strict=True):
            np.testing.assert_array_equal(found.index, expected.index)
            np.testing.assert_allclose(found.rows, expected.rows, rtol=1e-9, atol=1e-9)
