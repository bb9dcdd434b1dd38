"""Defects that these tests found, each as small as it could be made; a test moves to its own file once it passes."""

import numpy as np
import pytest

from identification.simulated import paper_robot, simulate, true_parameters
from identification.test_real_data import identified
from service.identification import identify
from shared_data import needs_shared_data


@pytest.mark.parametrize("seed", range(5))
def test_a_recording_without_noise_is_identified(seed: int) -> None:
    arm = simulate(paper_robot(), seed=seed)
    result = identify(arm.robot, [arm.recording()])
    truth = true_parameters(result, arm.robot)
    np.testing.assert_allclose(result.parameters, truth, rtol=0, atol=1e-6)


@needs_shared_data
def test_the_tx40_is_no_worse_held_out_than_the_readmes_own_fit() -> None:
    result = identified("staubli-tx40", 30.0)
    assert result.held_out is not None
    assert 100.0 * result.held_out.relative_error <= 21.1
