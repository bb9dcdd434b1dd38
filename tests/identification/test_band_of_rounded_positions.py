"""The band that positions from a real encoder allow, whether or not the recording says that its motion repeats."""

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.simulated import SimulatedArm, paper_robot, simulate
from tauscope.dynamics.base_parameters import base_parameters
from tauscope.identification.band import choose_cutoff
from tauscope.recording.conditioning import Conditioner

TORQUE_NOISE = 0.02
STEP = 2.0 * np.pi / 2**16
PERIOD_S = 10.0

LEAST_HZ = 3.0 * (15 + 4) / (2.0 * PERIOD_S)
"""Band with three rows for each of joint 1's parameters, 15 of the links and 4 of its friction, in the one period that
is left where the motion repeats: no narrower one is chosen, whatever the positions allow."""


def motion(seed: int) -> SimulatedArm:
    """Three periods of the paper's arm."""
    return simulate(paper_robot(), seed=seed, period_s=PERIOD_S)


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


@pytest.mark.parametrize("seed", [5, 6, 7, 8, 9, 10])
def test_rounding_that_repeats_is_not_averaged_away(seed: int) -> None:
    """To say that the motion repeats makes the torque better known, not the positions: the band must not be wider.

    Taken for noise that periods average, such rounding made it two to three and a half times as wide.
    """
    arm = motion(seed)
    plain = max(cutoff(arm, rounding(arm), periods=False), LEAST_HZ)
    assert cutoff(arm, rounding(arm), periods=True) <= 1.05 * plain


def test_noise_that_does_not_repeat_is_averaged_in_positions_and_torque_alike() -> None:
    arm = motion(5)
    noise = STEP / np.sqrt(12.0) * np.random.default_rng(2).standard_normal(arm.exact.exact.position.shape)
    ratio = cutoff(arm, noise, periods=True) / cutoff(arm, noise, periods=False)
    assert 0.6 < ratio < 1.3
