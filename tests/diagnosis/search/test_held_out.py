"""What held-out motion says of a hypothesis, in closed form and of a torque that is left out."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis.nominal_arm import nominal_rows
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.held_out_change import STRETCHES, stretches
from tauscope.diagnosis.noise.floor import white_noise
from tauscope.diagnosis.search.held_out import HeldOut

JOINT = 2


CERTAIN = 1e9
"""Inverse standard error of parameters that training tells."""


def at(model: ExtendedModel, known: float = CERTAIN) -> Any:
    """A hypothesis of which held-out motion asks."""
    posterior = SimpleNamespace(scale=np.ones(model.size), factor=known * np.eye(model.size))
    return SimpleNamespace(model=model, scales=(Scales.start(1.0),) * 3, posterior=posterior, dependence=(1.0,) * 3)


def with_offset(model: ExtendedModel, offset: float) -> ExtendedModel:
    place = model.structure.coefficient(JOINT, "offset")
    assert place is not None
    parameters = model.parameters.copy()
    parameters[place] += offset
    return replace(model, parameters=parameters)


@settings(max_examples=10)
@given(st.floats(0.5, 5.0))
def test_a_torque_that_is_not_there_is_refuted_at_its_joint_alone(offset: float) -> None:
    observations, model = nominal_rows()
    held_out = HeldOut(observations.with_noise(white_noise(observations, model)))
    worse = held_out.change(at(model), at(with_offset(model, offset)))
    assert worse.relative[JOINT] > 0.0
    assert worse.log_odds() < 0.0 < worse.harm
    others = [joint for joint in range(3) if joint != JOINT]
    np.testing.assert_allclose(worse.relative[others], 0.0, atol=1e-6)
    better = held_out.change(at(with_offset(model, offset)), at(model))
    assert better.log_odds() > 0.0
    assert better.harm == 0.0
    assert 1.0 + better.relative[JOINT] == pytest.approx(1.0 / (1.0 + worse.relative[JOINT]))


def test_what_training_leaves_open_refutes_nothing() -> None:
    observations, model = nominal_rows()
    held_out = HeldOut(observations.with_noise(white_noise(observations, model)))
    open_to_it, certain = (
        held_out.change(at(model, known), at(with_offset(model, 2.0), known)) for known in (1e-3, CERTAIN)
    )
    assert abs(open_to_it.relative[JOINT]) < 0.01 * certain.relative[JOINT]


def test_the_same_model_changes_nothing() -> None:
    observations, model = nominal_rows()
    found = HeldOut(observations.with_noise(white_noise(observations, model))).change(at(model), at(model))
    assert found.log_odds() == 0.0
    assert found.harm == 0.0


def test_a_stretch_is_predicted_from_training_and_all_other_stretches() -> None:
    """Against a fit of each stretch's rows left out, one after the other."""
    observations, model = nominal_rows()
    held_out = HeldOut(observations.with_noise(white_noise(observations, model)))
    asked = at(model, known=1.0)
    columns, residuals = held_out._white.all(model), held_out._white.residual(model)
    weights = [held_out._weights(joint, asked) for joint in range(3)]
    for left_out in (0, STRETCHES - 1):
        matrix, right = np.eye(model.size), np.zeros(model.size)
        for own, residual, weight in zip(columns, residuals, weights, strict=True):
            counted = weight.copy()
            counted[stretches(len(residual))[left_out]] = 0.0
            matrix[np.ix_(own.index, own.index)] += (counted * own.rows) @ own.rows.T
            right[own.index] += (counted * own.rows) @ residual
        step = np.linalg.solve(matrix, right)
        for own, residual, error in zip(columns, residuals, held_out._errors(asked), strict=True):
            rows = stretches(len(residual))[left_out]
            np.testing.assert_allclose(error[rows], (residual - step[own.index] @ own.rows)[rows], atol=1e-6)
