"""Friction curves, their confidence band, and what the recordings show."""

import numpy as np
import pytest

from report.conftest import NOISE_STD, Case
from tauscope.report.curves import friction_curve, torque_series
from tauscope.robot import read_robot
from tauscope_sim.examples import example_robot
from tauscope_sim.friction import static_friction_torque


@pytest.fixture(scope="module", params=range(3))
def joint(request: pytest.FixtureRequest) -> int:
    return request.param


def true_friction(joint: int, velocity: np.ndarray) -> np.ndarray:
    arm = read_robot(example_robot("paper_arm"))
    assert arm.model.friction is not None
    shape = arm.joints[joint].friction_shape
    return static_friction_torque(velocity[:, None], [arm.model.friction[joint]], [shape])[:, 0]


def test_the_truth_lies_within_the_band(case: Case, joint: int) -> None:
    curve = friction_curve(case.identification, [torque_series(case.identification, case.recordings[0])], joint)
    error = np.abs(curve.torque - true_friction(joint, curve.velocity))
    inside = (curve.velocity > curve.seen[0]) & (curve.velocity < curve.seen[1])
    assert (error < 4.0 * curve.std)[inside].all()
    assert (curve.std > 0).all()
    assert curve.std[inside].max() < 0.2


def test_the_recordings_own_means_follow_the_truth(case: Case, joint: int) -> None:
    curve = friction_curve(case.identification, [torque_series(case.identification, case.recordings[0])], joint)
    fast = np.abs(curve.bin_velocity) > 0.05
    difference = (curve.bin_torque - true_friction(joint, curve.bin_velocity))[fast]
    assert len(difference) > 15
    assert np.sqrt(np.mean(difference**2)) < NOISE_STD[joint] / 2


def test_the_curve_reaches_beyond_the_recordings(case: Case, joint: int) -> None:
    series = torque_series(case.identification, case.recordings[0])
    curve = friction_curve(case.identification, [series], joint)
    assert curve.seen == (series.velocity[:, joint].min(), series.velocity[:, joint].max())
    assert curve.velocity[0] < curve.seen[0] < 0 < curve.seen[1] < curve.velocity[-1]
    assert (np.diff(curve.velocity) > 0).all()


def test_series_are_measured_and_predicted_torque(case: Case) -> None:
    series = torque_series(case.identification, case.held_out[0])
    missed = np.isnan(series.measured)
    assert missed.sum() == 20
    assert missed[:, 1].sum() == 20
    assert np.sqrt(np.nanmean(series.residual**2, axis=0)) == pytest.approx(NOISE_STD, rel=0.25)
    assert torque_series(case.identification, case.recordings[0]).repetitions == 2
