"""Rows count less where a joint's velocity is smaller than its own error, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.test_repetitions import observed
from service.diagnosis.noise_floor import with_noise
from service.diagnosis.regressor_noise import _step_error, row_weights


def test_rows_far_from_reversals_count_fully_and_those_at_reversals_less() -> None:
    observations, model = observed()
    known, _ = with_noise(observations, model, ())
    weights = row_weights(known, model)
    assert [len(row) for row in weights] == [int(known.kept(joint).sum()) for joint in range(3)]
    for joint, own in enumerate(weights):
        (piece,) = known.pieces
        speed = np.abs(piece.prepared.motion.velocity[:, joint])
        rows = np.concatenate([piece.row_times()[known.noise[joint].order :]])[known.kept(joint)]
        near = np.array([speed[np.abs(piece.time[0] - t) < 0.25].min() for t in rows])
        assert own.max() <= 1.0
        assert own[near > 0.3].min() > 0.98
        assert own[near < 0.01].min() < 0.9


def test_the_step_is_known_as_well_as_the_velocity() -> None:
    _, model = observed()
    velocity = np.array([0.0, 0.001, 0.5])
    error = np.full(3, 0.001)
    terms = model.structure.terms[0]
    level = model.parameters[model.structure.coefficient(0, "stiction") or 0]
    column = model.structure.coefficient(0, "stribeck")
    fall = 0.0 if column is None else model.parameters[column]

    def curve(v: float) -> float:
        return 2.0 / np.pi * (level * np.arctan(terms.k_v * v) + fall * np.arctan((terms.delta or 0.0) * v))

    expected = [0.5 * abs(curve(v + 0.001) - curve(v - 0.001)) for v in velocity]
    assert _step_error(model, 0, velocity, error) == pytest.approx(expected)
    assert expected[2] < 1e-3 * expected[0]


def test_an_encoder_that_rounds_leaves_slow_motion_uncertain_and_one_that_is_merely_noisy_does_not() -> None:
    observations, model = observed()
    known, _ = with_noise(observations, model, ())
    (piece,) = known.pieces
    assert (piece.position_noise.step < 1e-6).all(), "these positions are not rounded"
    rounded_noise = replace(piece.position_noise, step=np.full(3, 0.01 / piece.state_hz))
    coarse = replace(known, pieces=(replace(piece, position_noise=rounded_noise),))
    for fine, rounded in zip(row_weights(known, model), row_weights(coarse, model), strict=True):
        assert (rounded <= fine + 1e-12).all()
        assert rounded.min() < fine.min()
        assert np.mean(rounded < 0.99 * fine) < 0.5, "fast motion crosses steps quickly: that is noise"


def test_a_model_that_leaves_nearly_everything_is_no_guide() -> None:
    quiet, _ = with_noise(*observed(), ())
    observations, model = observed(20.0)
    assert all((own == 1.0).all() for own in row_weights(observations.with_noise(quiet.noise), model))
