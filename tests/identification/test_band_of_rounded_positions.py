"""The band that positions from a real encoder allow, whether or not the recording says that its motion repeats."""

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.simulated import SimulatedArm, paper_robot, simulate
from service.dynamics.base_parameters import base_parameters
from service.identification.band import choose_cutoff
from service.recording.conditioning import Conditioner

TORQUE_NOISE = 0.02
STEP = 2.0 * np.pi / 2**16


@pytest.fixture(scope="module")
def arm() -> SimulatedArm:
    return simulate(paper_robot(), seed=5, period_s=10.0)


def cutoff(arm: SimulatedArm, position_noise: NDArray[np.float64], *, periods: bool) -> float:
    """Cut-off chosen for the arm's recording [Hz]."""
    torque_noise = arm.white(TORQUE_NOISE, np.random.default_rng(1))
    recording = arm.recording(torque_noise, position_noise, periods=periods)
    chosen = choose_cutoff([Conditioner.survey(recording, arm.robot)], arm.robot, base_parameters(arm.robot))
    assert chosen is not None
    return chosen


def rounding(arm: SimulatedArm) -> NDArray[np.float64]:
    """Error of an encoder that rounds: the same in every period, for the motion repeats to the sample."""
    exact = arm.exact.exact.position
    return np.round(exact / STEP) * STEP - exact


def test_rounding_that_repeats_is_not_averaged_away(arm: SimulatedArm) -> None:
    """To say that the motion repeats makes the torque better known, not the positions: the band hardly changes."""
    assert cutoff(arm, rounding(arm), periods=True) <= 1.25 * cutoff(arm, rounding(arm), periods=False)


def test_noise_that_does_not_repeat_is_averaged_in_positions_and_torque_alike(arm: SimulatedArm) -> None:
    noise = STEP / np.sqrt(12.0) * np.random.default_rng(2).standard_normal(arm.exact.exact.position.shape)
    ratio = cutoff(arm, noise, periods=True) / cutoff(arm, noise, periods=False)
    assert 0.6 < ratio < 1.3
