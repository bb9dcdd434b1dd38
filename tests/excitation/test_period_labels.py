"""The closing period carries the next index: conditioning averages the repeated periods and takes it for what it is."""

from collections.abc import Iterator

import numpy as np
import pytest

from excitation.excited_arms import Array, limited_paper_arm, short_search
from tauscope.dynamics import friction_torque, inverse_dynamics
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Recording

RATE_HZ = 100.0
NOISE_STD = np.array([0.5, 0.3, 0.7])


@pytest.fixture(scope="module", autouse=True)
def _short_search() -> Iterator[None]:
    with short_search():
        yield


def simulated(options: ExcitationOptions) -> tuple[Recording, Recording, Array]:
    """A noisy recording of a design with its labels, and with the closing period left unlabelled."""
    robot = limited_paper_arm()
    samples = design_excitation(robot, options).trajectory.samples(RATE_HZ)
    assert robot.model.links is not None
    assert robot.model.friction is not None
    parameters = np.concatenate([link.to_vector() for link in robot.model.links])
    torque = inverse_dynamics(robot, parameters, samples.position, samples.velocity, samples.acceleration)
    for j, joint in enumerate(robot.joints):
        torque[:, j] += friction_torque(robot.model.friction[j], joint.friction_shape, samples.velocity[:, j])
    rng = np.random.default_rng(0)
    torque += rng.normal(size=torque.shape) * NOISE_STD
    position = samples.position + rng.normal(scale=1e-5, size=torque.shape)
    unlabelled = np.where(samples.period == options.periods, np.nan, samples.period)
    recordings = [
        Recording.from_arrays(name, samples.time, position, torque, period=period)
        for name, period in (("labelled", samples.period), ("unlabelled", unlabelled))
    ]
    return recordings[0], recordings[1], samples.period


def test_the_closing_period_s_label_changes_nothing_that_is_averaged() -> None:
    robot = limited_paper_arm()
    labelled, unlabelled, period = simulated(ExcitationOptions(periods=3, starts=1, slow_postures=1))
    assert np.count_nonzero(period == 3) == 1000
    results = []
    for recording in (labelled, unlabelled):
        conditioner = Conditioner.survey(recording, robot)
        results.append((conditioner.summary(5.0), list(conditioner.motions(5.0))))
    for summary, _ in results:
        assert summary.averaged_periods == 3
    for mine, other in zip(results[0][1], results[1][1], strict=True):
        assert mine.repetitions == other.repetitions
        assert np.array_equal(mine.position, other.position)
        assert np.array_equal(mine.torque, other.torque, equal_nan=True)


def test_without_slow_reversals_the_closing_period_is_one_more_repeat() -> None:
    robot = limited_paper_arm()
    labelled, _, _ = simulated(ExcitationOptions(periods=2, starts=1, slow_postures=0))
    assert Conditioner.survey(labelled, robot).summary(5.0).averaged_periods == 3
