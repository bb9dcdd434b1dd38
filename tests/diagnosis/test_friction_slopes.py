"""Slopes that an identification left open: found where the data show them, left where they do not."""

from dataclasses import replace

import numpy as np
import pytest

from identification.simulated import PAPER_NOISE, paper_robot, simulate, with_shapes
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.fitting.friction_slopes import open_slopes, with_fitting_slopes, with_fitting_stribeck
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.nominal import nominal_model
from tauscope.diagnosis.noise.floor import with_noise
from tauscope.diagnosis.observations.observations import Observations
from tauscope.identification import identify
from tauscope.recording.conditioning import Conditioner
from tauscope.robot import FrictionCoefficients

pytestmark = pytest.mark.slow

SPEED = np.full(3, 1.0)
NO_STRIBECK = tuple(FrictionCoefficients(stiction, 0.0, 0.3) for stiction in (2.0, 1.0, 2.0))
"""With a Stribeck term its slope may take the other one's place."""


def far_away(model: ExtendedModel, slope: float) -> ExtendedModel:
    """The model with slopes from which no step leads anywhere."""
    terms = tuple(replace(each, k_v=slope) for each in model.structure.terms)
    return replace(model, structure=model.structure.with_terms(terms))


def fitted_slopes(true_slope: float) -> list[float]:
    rng = np.random.default_rng(3)
    arm = simulate(with_shapes(paper_robot(), true_slope, None), seed=2, periods=3, friction=NO_STRIBECK)
    recording = arm.recording(arm.white(0.1 * PAPER_NOISE, rng), 2e-6 * rng.standard_normal((1, 3)))
    found = identify(with_shapes(arm.robot, None, None), [recording])
    conditioners = [Conditioner.survey(recording, found.robot)]
    model = far_away(nominal_model(found), 3000.0)
    rows = Observations.prepare(conditioners, found.robot, found.structure.base, 20.0, model.steepness)
    rows, _ = with_noise(rows, model, ())
    fitted = with_fitting_slopes(model, Fitter(rows), range(3), SPEED)
    return [terms.k_v for terms in fitted.structure.terms]


def test_a_gentle_slope_is_found_from_far_away() -> None:
    np.testing.assert_allclose(fitted_slopes(15.0), 15.0, rtol=0.1)


def test_only_slopes_that_nobody_stated_and_no_data_showed_are_open() -> None:
    rng = np.random.default_rng(4)
    arm = simulate(with_shapes(paper_robot(), 15.0, 2.0), seed=2, periods=3)
    recording = arm.recording(arm.white(0.1 * PAPER_NOISE, rng))
    assert open_slopes(identify(with_shapes(arm.robot, 15.0, 2.0), [recording])) == []
    assert open_slopes(identify(with_shapes(arm.robot, None, None), [recording])) == []


def fitted_stribeck(stribeck: float) -> list[float | None]:
    """Slopes δ of the terms that a model without any is given, on an arm whose second joint has one of this size."""
    rng = np.random.default_rng(6)
    plain = simulate(with_shapes(paper_robot(), 60.0, 5.0), seed=2, periods=3, friction=NO_STRIBECK)
    model = nominal_model(
        identify(with_shapes(plain.robot, 60.0, None), [plain.recording(plain.white(0.1 * PAPER_NOISE, rng))])
    )
    assert [terms.delta for terms in model.structure.terms] == [None] * 3
    friction = (NO_STRIBECK[0], FrictionCoefficients(1.0, stribeck, 0.3), NO_STRIBECK[2])
    arm = simulate(with_shapes(paper_robot(), 60.0, 5.0), seed=2, periods=3, friction=friction)
    recording = arm.recording(arm.white(0.1 * PAPER_NOISE, rng), 2e-6 * rng.standard_normal((1, 3)))
    conditioners = [Conditioner.survey(recording, arm.robot)]
    rows = Observations.prepare(conditioners, arm.robot, model.structure.base, 20.0, model.steepness)
    rows, _ = with_noise(rows, model, ())
    fitted = with_fitting_stribeck(model, Fitter(rows), range(3), SPEED)
    return [terms.delta for terms in fitted.structure.terms]


def test_a_stribeck_term_that_the_identification_left_out_is_the_plain_models_own() -> None:
    first, fitted, last = fitted_stribeck(-0.1)
    assert first is None
    assert last is None
    assert fitted is not None
    assert 3.5 < fitted < 7.0


def test_friction_that_rises_with_speed_is_no_stribeck_term() -> None:
    assert fitted_stribeck(0.1) == [None] * 3
