"""Defects that these tests found, each as small as it could be made; a test moves to its own file once it passes."""

import numpy as np
import pytest

from identification.simulated import paper_robot, simulate, true_parameters
from service.identification import identify


@pytest.mark.parametrize("seed", range(5))
def test_a_recording_without_noise_is_identified(seed: int) -> None:
    arm = simulate(paper_robot(), seed=seed)
    result = identify(arm.robot, [arm.recording()])
    truth = true_parameters(result, arm.robot)
    np.testing.assert_allclose(result.parameters, truth, rtol=0, atol=1e-6)
