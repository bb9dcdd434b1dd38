"""Standard errors that mean what they say, whatever the noise: its colour, its size at each joint, noisy encoders."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import signal, stats

from identification.simulated import (
    PAPER_NOISE,
    Array,
    SimulatedArm,
    paper_robot,
    rms,
    runs,
    simulate,
    standard_errors,
    true_parameters,
    z_scores,
)
from tauscope.identification import Estimator, Identification, Options, identify
from tauscope.identification.dataset import Dataset
from tauscope.identification.least_squares import factorise, solve
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner

FALSE_ALARM = 1e-4


@pytest.fixture(scope="module")
def slow_arm() -> SimulatedArm:
    """Three periods of ten seconds at 100 Hz."""
    return simulate(paper_robot(), seed=2)


@pytest.fixture(scope="module")
def fast_arm() -> SimulatedArm:
    """Five periods at 200 Hz."""
    return simulate(paper_robot(), seed=3, rate_hz=200.0, periods=5)


def autoregressive(arm: SimulatedArm, std: Array, coefficient: float, rng: np.random.Generator) -> Array:
    """Stationary AR(1) noise of this standard deviation, (N, n)."""
    innovations = np.sqrt(1.0 - coefficient**2) * arm.white(1.0, rng)
    innovations[0] /= np.sqrt(1.0 - coefficient**2)
    return std * signal.lfilter([1.0], [1.0, -coefficient], innovations, axis=0)


def runs_of(
    arm: SimulatedArm, count: int, draw: Callable[[np.random.Generator], Recording], seed: int = 1
) -> list[Identification]:
    """Free estimates from recordings that differ by their noise alone."""
    rng = np.random.default_rng(seed)
    return [identify(arm.robot, [draw(rng)], options=Options(prior=False)) for _ in range(count)]


def scores(results: list[Identification], arm: SimulatedArm) -> Array:
    """z-scores of all runs, (R, p); every run has to have the terms of the truth."""
    assert {result.structure.names for result in results} == {results[0].structure.names}
    assert results[0].structure.size == 27
    return np.array([z_scores(result, arm.robot) for result in results])


def assert_unbiased(results: list[Identification], arm: SimulatedArm) -> None:
    """The mean of all estimates lies within its own standard error of the truth, at `FALSE_ALARM` in all."""
    estimates = np.array([result.free_parameters for result in results])
    truth = true_parameters(results[0], arm.robot)
    standard_error = estimates.std(axis=0, ddof=1) / np.sqrt(len(results))
    bound = stats.t.ppf(1.0 - FALSE_ALARM / (2 * len(truth)), len(results) - 1)
    assert (np.abs(estimates.mean(axis=0) - truth) <= bound * standard_error).all()


def naive_scores(recording: Recording, result: Identification, arm: SimulatedArm) -> Array:
    """z-scores with (LᵀΣ⁻¹L)⁻¹, which takes the residual for white, as the covariance."""
    conditioner = Conditioner.survey(recording, arm.robot)
    motions = Dataset([conditioner], arm.robot, result.structure.base, result.cutoff_hz)
    factors = factorise(motions, result.structure)
    std = [np.sqrt(factor.squared_residual(result.free_parameters) / factor.rows) for factor in factors]
    spread = solve(factors, result.structure.size, np.array(std)).spread
    naive = np.sqrt(np.sum(spread**2, axis=1))
    return (result.free_parameters - true_parameters(result, arm.robot)) / naive


@runs(6, 100)
def test_autocorrelated_noise_widens_the_standard_errors(slow_arm: SimulatedArm, runs: int) -> None:
    recordings = []

    def draw(rng: np.random.Generator) -> Recording:
        recordings.append(slow_arm.recording(autoregressive(slow_arm, PAPER_NOISE, 0.9, rng), periods=False))
        return recordings[-1]

    results = runs_of(slow_arm, runs, draw)
    z = scores(results, slow_arm)
    assert 0.85 <= rms(z) <= 1.2
    naive = np.array([naive_scores(r, f, slow_arm) for r, f in zip(recordings[:10], results[:10], strict=True)])
    assert rms(naive) > 1.5 * rms(z[:10]), "the case is no test: white noise would have given the same"
    assert_unbiased(results, slow_arm)


@pytest.mark.slow
@runs(6, 40)
def test_autocorrelated_noise_with_samples_missed(slow_arm: SimulatedArm, runs: int) -> None:
    """A sample in twenty: pairs of neighbours are fewer, not less alike."""

    def draw(rng: np.random.Generator) -> Recording:
        noise = autoregressive(slow_arm, PAPER_NOISE, 0.9, rng)
        noise[rng.random(noise.shape) < 0.05] = np.nan
        return slow_arm.recording(noise, periods=False)

    assert 0.85 <= rms(scores(runs_of(slow_arm, runs, draw), slow_arm)) <= 1.2


@pytest.mark.parametrize("seed", [3, 4])
@runs(6, 100)
def test_autocorrelated_noise_in_averaged_periods(seed: int, runs: int) -> None:
    """Six periods averaged into one: of their noise the single periods tell more than the few rows of the mean."""
    arm = simulate(paper_robot(), seed=seed, periods=6)
    results = runs_of(arm, runs, lambda rng: arm.recording(autoregressive(arm, PAPER_NOISE, 0.9, rng)))
    assert 0.85 <= rms(scores(results, arm)) <= 1.2
    assert_unbiased(results, arm)


@pytest.mark.slow
@pytest.mark.parametrize("coefficient", [-0.5, 0.5])
@runs(6, 30)
def test_other_colours_of_noise(slow_arm: SimulatedArm, coefficient: float, runs: int) -> None:
    def draw(rng: np.random.Generator) -> Recording:
        return slow_arm.recording(autoregressive(slow_arm, PAPER_NOISE, coefficient, rng))

    assert 0.85 <= rms(scores(runs_of(slow_arm, runs, draw), slow_arm)) <= 1.15


@pytest.mark.slow
@runs(8, 30)
def test_joints_of_very_different_noise(slow_arm: SimulatedArm, runs: int) -> None:
    std = np.array([2.0, 0.02, 0.2])
    results = runs_of(slow_arm, runs, lambda rng: slow_arm.recording(slow_arm.white(std, rng)))
    assert 0.9 <= rms(scores(results, slow_arm)) <= 1.1
    noise = np.array([result.residuals.noise_std for result in results])
    np.testing.assert_allclose(noise.mean(axis=0), std, rtol=0.01)
    # LS lets joint 1 spoil what joints 2 and 3 know; its standard errors have to say so.
    recording = slow_arm.recording(slow_arm.white(std, np.random.default_rng(4)))
    ls = identify(slow_arm.robot, [recording], options=Options(estimator=Estimator.LS))
    assert np.abs(z_scores(ls, slow_arm.robot)).max() < 4.5
    mass = ls.structure.names.index("m3 + 2*msx3")
    assert standard_errors(ls)[mass] > 3.0 * standard_errors(results[0])[mass]


@pytest.mark.slow
def test_averaging_periods_changes_no_answer(slow_arm: SimulatedArm) -> None:
    """Without encoder noise a mean of periods holds the same information as the periods one by one."""
    for seed in range(5):
        noise = slow_arm.white(PAPER_NOISE, np.random.default_rng(seed))
        averaged = identify(slow_arm.robot, [slow_arm.recording(noise)])
        apart = identify(slow_arm.robot, [slow_arm.recording(noise, periods=False)])
        assert (averaged.conditioning[0].averaged_periods, apart.conditioning[0].averaged_periods) == (3, 0)
        difference = (averaged.free_parameters - apart.free_parameters) / standard_errors(averaged)
        assert np.abs(difference).max() < 0.5  # some edge samples of 3,000 are trimmed in one of the two
        np.testing.assert_allclose(standard_errors(averaged), standard_errors(apart), rtol=0.1)


def test_periods_tell_the_noise_within_five_percent(fast_arm: SimulatedArm) -> None:
    results = runs_of(fast_arm, 15, lambda rng: fast_arm.recording(fast_arm.white(PAPER_NOISE, rng)))
    ratio = np.array([result.residuals.noise_std for result in results]) / PAPER_NOISE
    assert {result.residuals.noise_method for result in results} == {"periods"}
    assert np.abs(ratio - 1.0).max() < 0.05
    np.testing.assert_allclose(ratio.mean(axis=0), 1.0, atol=4.0 / np.sqrt(2 * 15 * 4 * 2000))


def test_the_residual_tells_the_noise_within_ten_percent(fast_arm: SimulatedArm) -> None:
    results = runs_of(fast_arm, 10, lambda rng: fast_arm.recording(fast_arm.white(PAPER_NOISE, rng), periods=False))
    ratio = np.array([result.residuals.noise_std for result in results]) / PAPER_NOISE
    assert {result.residuals.noise_method for result in results} == {"residual"}
    assert np.abs(ratio - 1.0).max() < 0.1


def test_periods_tell_the_noise_where_the_model_is_wrong(fast_arm: SimulatedArm) -> None:
    """A torque that no model of ours has, but the same in every period, is no noise."""
    position = fast_arm.exact.exact.position
    missing = 1.5 * np.sin(7.0 * position)
    noise = fast_arm.white(PAPER_NOISE, np.random.default_rng(8))
    result = identify(fast_arm.robot, [fast_arm.recording(noise, extra_torque=missing)])
    assert (result.residuals.fit.rms > 1.5 * PAPER_NOISE).all()
    np.testing.assert_allclose(result.residuals.noise_std, PAPER_NOISE, rtol=0.05)


@pytest.mark.parametrize("periods", [True, False], ids=["averaged", "one motion"])
@runs(4, 80)
def test_encoder_noise_neither_biases_nor_fools(fast_arm: SimulatedArm, periods: bool, runs: int) -> None:
    def draw(rng: np.random.Generator) -> Recording:
        torque, position = fast_arm.white(PAPER_NOISE, rng), fast_arm.white(2e-5, rng)
        return fast_arm.recording(torque, position, periods=periods)

    results = runs_of(fast_arm, runs, draw)
    assert all(result.cutoff_hz is not None for result in results)
    assert 0.85 <= rms(scores(results, fast_arm)) <= 1.2
    if periods:  # one motion has a bias yet, of half a standard error: see the found defects
        assert_unbiased(results, fast_arm)
    found = np.array([result.conditioning[0].position_noise_std for result in results])
    np.testing.assert_allclose(found, 2e-5, rtol=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
@runs(4, 60)
def test_encoder_noise_does_not_bias_where_torque_noise_is_small(seed: int, runs: int) -> None:
    """The band has to end where the noise of q̈ makes less torque than the torque's own noise, not less than q̈."""
    arm = simulate(paper_robot(), seed=seed, rate_hz=200.0, periods=5)

    def draw(rng: np.random.Generator) -> Recording:
        return arm.recording(arm.white(0.1 * PAPER_NOISE, rng), arm.white(2e-5, rng), periods=False)

    assert rms(scores(runs_of(arm, runs, draw), arm)) <= 1.2


@pytest.mark.slow
def test_the_residual_tells_the_torque_noise_beside_encoder_noise() -> None:
    arm = simulate(paper_robot(), seed=4, rate_hz=200.0, periods=5)
    results = runs_of(
        arm, 5, lambda rng: arm.recording(arm.white(PAPER_NOISE, rng), arm.white(2e-5, rng), periods=False)
    )
    noise = np.array([result.residuals.noise_std for result in results])
    assert np.abs(noise / PAPER_NOISE - 1.0).max() < 0.1


@pytest.mark.slow
def test_encoder_noise_does_not_bias_one_long_motion() -> None:
    arm = simulate(paper_robot(), seed=3, rate_hz=200.0, periods=5)
    results = runs_of(
        arm, 80, lambda rng: arm.recording(arm.white(PAPER_NOISE, rng), arm.white(2e-5, rng), periods=False)
    )
    assert_unbiased(results, arm)
