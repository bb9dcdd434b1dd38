"""Defects that these tests found, each as small as it could be made; a test moves to its own file once it passes."""

from dataclasses import replace

import numpy as np
import pytest

from identification.simulated import (
    PAPER_NOISE,
    SimulatedArm,
    paper_robot,
    rms,
    simulate,
    with_shapes,
    z_scores,
)
from identification.test_friction_shapes import identified as identified_without_shapes
from identification.test_real_data import identified
from identification.test_uncertainty import assert_unbiased, autoregressive, runs_of, scores
from service.identification import document, identify
from service.recording import Recording
from shared_data import needs_shared_data
from sim_backend.motion import random_fourier_motion


@needs_shared_data
def test_the_tx40_is_no_worse_held_out_than_the_readmes_own_fit() -> None:
    result = identified("staubli-tx40", 30.0)
    assert result.held_out is not None
    assert 100.0 * result.held_out.relative_error <= 21.1


@pytest.mark.parametrize(
    ("k_v", "delta", "period_s", "seed", "noise"),
    [
        (60.0, 6.0, 20.0, 3, 0.1),
        (60.0, 3.0, 20.0, 3, 0.1),
        (100.0, 4.0, 20.0, 3, 0.01),
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


def test_autocorrelated_noise_with_samples_missed() -> None:
    """Lagged products with a sample missing count as zero in the mean: the noise looks whiter than it is."""
    arm = simulate(paper_robot(), seed=2)

    def draw(rng: np.random.Generator) -> Recording:
        noise = autoregressive(arm, PAPER_NOISE, 0.9, rng)
        noise[rng.random(noise.shape) < 0.3] = np.nan
        return arm.recording(noise, periods=False)

    assert rms(scores(runs_of(arm, 40, draw), arm)) <= 1.12  # nothing missed: 0.99


def held_still(reach: float) -> SimulatedArm:
    """The paper's arm, joint 3 moving by this much of its usual motion."""
    robot = paper_robot()
    moving = random_fourier_motion(robot.joints, np.random.default_rng(2))
    scale = np.array([1.0, 1.0, reach])[:, None]
    return simulate(robot, motion=replace(moving, cosine=moving.cosine * scale, sine=moving.sine * scale))


@pytest.mark.parametrize("periods", [True, False], ids=["periods", "one motion"])
@pytest.mark.parametrize("reach", [0.0, 1e-8])
def test_a_joint_held_still_leaves_its_friction_undetermined(reach: float, periods: bool) -> None:
    """The velocity's rounding counts as motion: 1e6 to 1e13 Nm are delivered, and where the joint moves held out,
    the error is as large. With 0 in periods: divisions by zero.
    """
    arm, other = held_still(reach), simulate(paper_robot(), seed=2)
    recording = arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(0)), periods=periods)
    held_out = other.recording(other.white(PAPER_NOISE, np.random.default_rng(1)))
    result = identify(arm.robot, [recording], [held_out])
    found = document(result)
    assert {"stiction joint3", "stribeck joint3", "viscous joint3"} <= set(found.undetermined)
    assert [found.friction[2].std[name] for name in ("stiction", "stribeck", "viscous")] == [None, None, None]
    assert not any(found.friction[2].identifiable[name] for name in ("stiction", "stribeck", "viscous"))
    assert "offset joint3" not in found.undetermined
    determined = ~result.undetermined
    assert np.abs(z_scores(result, arm.robot)[determined]).max() < 4.5
    assert np.abs(result.parameters[~determined]).max() < 1.0  # what has no information takes its smallest value
    assert found.fit.held_out is not None
    assert found.fit.held_out.rms[2] < 5.0  # joint 3's friction is 2 Nm


@pytest.mark.parametrize("periods", [True, False], ids=["periods", "one motion"])
def test_a_joint_that_moves_a_millionth_has_honest_errors(periods: bool) -> None:
    """-1e9 Nm with a standard error of 20 Nm: the covariance leaves out directions (values below 1e-14 of the normal
    matrix, 1e-7 of the factor) that the solution keeps (down to 1e-9 of the factor)."""
    arm = held_still(1e-6)
    recording = arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(0)), periods=periods)
    result = identify(arm.robot, [recording])
    determined = ~result.undetermined
    assert np.abs(z_scores(result, arm.robot)[determined]).max() < 4.5
    assert not any(document(result).friction[2].identifiable[name] for name in ("stiction", "stribeck", "viscous"))


def test_the_residual_tells_the_torque_noise_beside_encoder_noise() -> None:
    """2e-5 rad at 200 Hz make modelled torque noisy, and joint 2's torque noise comes out 15 % too large."""
    arm = simulate(paper_robot(), seed=4, rate_hz=200.0, periods=5)
    results = runs_of(
        arm, 5, lambda rng: arm.recording(arm.white(PAPER_NOISE, rng), arm.white(2e-5, rng), periods=False)
    )
    noise = np.array([result.residuals.noise_std for result in results])
    assert np.abs(noise / PAPER_NOISE - 1.0).max() < 0.1


@pytest.mark.slow
def test_encoder_noise_does_not_bias_one_long_motion() -> None:
    """Mean z-scores of 0.5 in the automatic band of 16 Hz, of 0.25 at 12 Hz, none at 8 Hz; the spread is the same."""
    arm = simulate(paper_robot(), seed=3, rate_hz=200.0, periods=5)
    results = runs_of(
        arm, 80, lambda rng: arm.recording(arm.white(PAPER_NOISE, rng), arm.white(2e-5, rng), periods=False)
    )
    assert_unbiased(results, arm)
