"""Rows count less where a joint's velocity is smaller than its own error, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.test_repetitions import observed
from tauscope.diagnosis.fitting.regressor_noise import (
    MOVED,
    ROUNDED,
    _step_error,
    _steps,
    shared_errors,
    weightings_of_motion,
)
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.noise.floor import with_pure_error
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.whitening import JointNoise
from tauscope.identification.autocorrelation import Autoregression
from tauscope.recording.conditioning.filters import smooth


def test_rows_far_from_reversals_count_fully_and_those_at_reversals_less() -> None:
    observations, model = observed()
    known = with_pure_error(observations, model)
    assert known is not None
    weights = [each.weights for each in weightings_of_motion(known, model)]
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
    known = with_pure_error(observations, model)
    assert known is not None
    (piece,) = known.pieces
    assert (piece.position_noise.step < 1e-6).all(), "these positions are not rounded"
    rounded_noise = replace(piece.position_noise, step=0.01 / piece.state_hz)
    coarse = replace(known, pieces=(replace(piece, position_noise=rounded_noise),))
    both = [[each.weights for each in weightings_of_motion(seen, model)] for seen in (known, coarse)]
    for fine, rounded in zip(*both, strict=True):
        assert (rounded <= fine + 1e-12).all()
        assert rounded.min() < fine.min()
        assert np.mean(rounded < 0.99 * fine) < 0.5, "fast motion crosses steps quickly: that is noise"


def observed_without_noise() -> tuple[Observations, ExtendedModel]:
    """Observations whose noise is nearly nothing, and their model."""
    observations, model = observed()
    return observations.with_noise([JointNoise(Autoregression(np.empty(0), 1e-6, 1e-6))] * 3), model


def test_what_a_band_may_have_made_of_all_reversals_passes_for_no_more_than_noise() -> None:
    """A part of what half of it rounds them by, and a shift of all of them by a part of its period."""
    known, model = observed_without_noise()
    (piece,) = known.pieces
    motion = piece.prepared.motion
    for joint, own in enumerate(weightings_of_motion(known, model)):
        band_hz = float(piece.state_hz[joint])
        friction = _steps(model, joint, motion.velocity[:, joint])
        narrow = smooth(motion.velocity[:, [joint]], motion.rate_hz, 0.5 * band_hz)[:, 0]
        rates = np.stack([_steps(model, joint, narrow) - friction, np.gradient(friction) * motion.rate_hz])
        change, slope = known.white(joint, [piece.reduced(rates)])
        rounded = ROUNDED * (change - (change @ slope) / (slope @ slope) * slope)
        for error in (rounded, MOVED[0] / band_hz * slope):
            assert np.sum((own.weights * error) ** 2) > 2.0
            assert np.sum(own.applied(error[None]) ** 2) < 1.0


@pytest.mark.parametrize(("step", "part"), [(0.0, 0), (1.0, 1)])
def test_a_band_moves_reversals_by_a_part_of_its_period_and_more_where_steps_are_followed(
    step: float, part: int
) -> None:
    known, model = observed_without_noise()
    (piece,) = known.pieces
    coarse = replace(piece, position_noise=replace(piece.position_noise, step=np.full(3, step)))
    known, motion = replace(known, pieces=(coarse,)), piece.prepared.motion
    for joint, band_hz in enumerate(piece.state_hz):
        slope = np.gradient(_steps(model, joint, motion.velocity[:, joint])) * motion.rate_hz
        white = known.white(joint, [piece.reduced(slope[None])])[0]
        _, moved = shared_errors(known, model, joint, np.ones(len(white)))
        np.testing.assert_allclose(moved, MOVED[part] / band_hz * white, atol=1e-9 * np.abs(moved).max())
