"""Errors at the recorded rate: of motion, not of stops, where no model knows which friction holds the joint."""

import numpy as np
import pytest

from diagnosis.nominal_arm import nominal_rows, stopping
from tauscope.diagnosis.model.residual import raw_squares

JOINT = 1


def test_samples_of_a_stop_are_left_out_at_the_joint_that_stops() -> None:
    observations, model = nominal_rows()
    whole, every = raw_squares(model, stopping(observations, JOINT))
    squares, samples = raw_squares(model, stopping(observations, JOINT, slice(100, 200)))
    rows = sum(piece.rows for piece in observations)
    left_out = len(observations.pieces) * 100 / rows
    assert samples[JOINT] == pytest.approx((1.0 - left_out) * every[JOINT], rel=0.01)
    counted = squares[JOINT] > 0.0
    assert np.count_nonzero(counted) == pytest.approx(samples[JOINT], rel=0.01)
    np.testing.assert_array_equal(squares[JOINT, counted], whole[JOINT, counted])
    others = [joint for joint in range(len(samples)) if joint != JOINT]
    np.testing.assert_array_equal(squares[others], whole[others])
    np.testing.assert_array_equal(samples[others], every[others])


def test_a_joint_that_never_moves_keeps_all_its_samples() -> None:
    observations, model = nominal_rows()
    _, every = raw_squares(model, stopping(observations, JOINT))
    _, still = raw_squares(model, stopping(observations, JOINT, slice(None)))
    np.testing.assert_array_equal(still, every)
