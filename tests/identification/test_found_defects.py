"""Defects that these tests found, each as small as it could be made; a test moves to its own file once it passes."""

import numpy as np
import pytest

from identification.simulated import (
    PAPER_NOISE,
    paper_robot,
    rms,
    simulate,
    standard_errors,
    true_parameters,
    with_shapes,
    z_scores,
)
from identification.test_friction_shapes import identified as identified_without_shapes
from identification.test_real_data import identified
from identification.test_uncertainty import assert_unbiased, autoregressive, runs_of, scores
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


@pytest.mark.parametrize("seed", [3, 4])
def test_autocorrelated_noise_in_averaged_periods(seed: int) -> None:
    """Six periods averaged into one: the standard errors are 15 to 20 % too small, P = 1 has them right."""
    arm = simulate(paper_robot(), seed=seed, periods=6)
    results = runs_of(arm, 60, lambda rng: arm.recording(autoregressive(arm, PAPER_NOISE, 0.9, rng)))
    assert rms(scores(results, arm)) <= 1.12  # white noise: 1.00


@pytest.mark.parametrize("seed", [3, 4])
def test_encoder_noise_does_not_bias_where_torque_noise_is_small(seed: int) -> None:
    """The automatic band (16 and 20 Hz) lets noise of q̈ through: at a cut-off of 12 Hz the bias is gone."""
    arm = simulate(paper_robot(), seed=seed, rate_hz=200.0, periods=5)
    results = runs_of(
        arm, 15, lambda rng: arm.recording(arm.white(0.1 * PAPER_NOISE, rng), arm.white(2e-5, rng), periods=False)
    )
    assert rms(scores(results, arm)) <= 1.2


@pytest.mark.slow
def test_encoder_noise_does_not_bias_one_long_motion() -> None:
    arm = simulate(paper_robot(), seed=3, rate_hz=200.0, periods=5)
    results = runs_of(
        arm, 80, lambda rng: arm.recording(arm.white(PAPER_NOISE, rng), arm.white(2e-5, rng), periods=False)
    )
    assert_unbiased(results, arm)


@pytest.mark.parametrize(
    ("k_v", "delta", "period_s", "seed", "noise"),
    [
        (60.0, 6.0, 20.0, 3, 0.1),
        (60.0, 3.0, 20.0, 3, 0.1),
        (100.0, 4.0, 20.0, 3, 0.01),
        (500.0, 10.0, 10.0, 2, 0.001),
    ],
)
def test_shape_constants_at_a_high_signal_to_noise_ratio(
    k_v: float, delta: float, period_s: float, seed: int, noise: float
) -> None:
    """The better the data, the more a constant counts as open: its profile is judged beside an unrefined other one."""
    arm = simulate(with_shapes(paper_robot(), k_v, delta), seed=seed, period_s=period_s)
    for run in range(5):
        result = identified_without_shapes(arm, noise * PAPER_NOISE, run)
        assert all(shape.k_v_identifiable and shape.delta_identifiable for shape in result.shapes)
        assert [shape.k_v for shape in result.shapes] == pytest.approx([k_v] * 3, rel=0.1)
        assert np.abs(z_scores(result, arm.robot)).max() < 4.5
