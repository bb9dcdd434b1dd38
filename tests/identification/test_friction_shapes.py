"""K_v and δ of the friction curve: found where data show them, said to be open where they do not, never invented."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from identification.simulated import (
    PAPER_NOISE,
    Array,
    SimulatedArm,
    paper_robot,
    rms,
    runs,
    simulate,
    standard_errors,
    with_shapes,
    z_scores,
)
from tauscope.identification import Identification, Options, document, identify
from tauscope.identification.friction_shape import shape_parameters
from tauscope.robot import FrictionCoefficients, FrictionShape, Model, Robot

WITHOUT_STRIBECK = [FrictionCoefficients(2.0, 0.0, 0.5), FrictionCoefficients(1.0, 0.0, 0.277)]
WITHOUT_STRIBECK.append(FrictionCoefficients(2.0, 0.0, 0.03))

STEEPEST = 10**4.35
"""No estimate of K_v times the joint's rms velocity may exceed this: a user once got a slope of 2.5e8."""

ORDINARY = (30.0, 3000.0)
"""K_v times the rms velocity of a step as people write it down, where the data leave it open."""


def unknown(robot: Robot) -> Robot:
    """What the user has: no constants, no model."""
    return replace(with_shapes(robot, None, None), model=Model())


def identified(arm: SimulatedArm, noise: Array | float, seed: int, extra: Array | float = 0.0) -> Identification:
    """The arm's identification without any word about its friction's shape."""
    drawn = arm.white(noise, np.random.default_rng(seed))
    return identify(unknown(arm.robot), [arm.recording(drawn, extra_torque=extra)])


def shape_scores(result: Identification, k_v: float, delta: float | None) -> Array:
    """(log estimate - log truth) / standard error of all constants that were found."""
    std = np.sqrt(np.diag(result.covariance)[result.structure.size :])
    truth = {"k_v": k_v, "delta": delta}
    scores = []
    for (joint, name), error in zip(shape_parameters(result.shapes), std, strict=True):
        constant = truth[name]
        assert constant is not None
        scores.append(np.log(getattr(result.shapes[joint], name) / constant) / error)
    return np.array(scores)


def rms_speed(arm: SimulatedArm) -> Array:
    return np.sqrt(np.mean(arm.exact.exact.velocity**2, axis=0))


@pytest.mark.parametrize(
    ("k_v", "delta", "period_s", "seed"), [(500.0, 10.0, 10.0, 2), (500.0, 10.0, 10.0, 3), (200.0, 8.0, 10.0, 2)]
)
@runs(3, 60)
def test_constants_that_the_motion_shows_are_found_within_their_errors(
    k_v: float, delta: float, period_s: float, seed: int, runs: int
) -> None:
    arm = simulate(with_shapes(paper_robot(), k_v, delta), seed=seed, period_s=period_s)
    results = [identified(arm, 0.1 * PAPER_NOISE, run) for run in range(runs)]
    for result in results:
        assert all(shape.k_v_identifiable and shape.delta_identifiable for shape in result.shapes)
        assert not any(shape.k_v_given or shape.delta_given for shape in result.shapes)
    shapes = np.array([shape_scores(result, k_v, delta) for result in results])
    coefficients = np.array([z_scores(result, arm.robot) for result in results])
    for z in (shapes, coefficients):
        if runs >= 60:
            assert 0.85 <= rms(z) <= 1.15
        least, most = (float(stats.chi2.ppf(share, runs)) / runs for share in (1e-6, 1.0 - 1e-6))
        assert (np.mean(z**2, axis=0) >= least).all()
        assert (np.mean(z**2, axis=0) <= most).all()


@pytest.mark.parametrize("seed", [2, 3])
@runs(2, 4)
def test_constants_at_a_very_high_signal_to_noise_ratio(seed: int, runs: int) -> None:
    arm = simulate(paper_robot(), seed=seed)
    for run in range(runs):
        result = identified(arm, 0.001 * PAPER_NOISE, run)
        assert all(shape.k_v_identifiable and shape.delta_identifiable for shape in result.shapes)
        assert [shape.k_v for shape in result.shapes] == pytest.approx([500.0] * 3, rel=1e-3)
        assert [shape.delta for shape in result.shapes] == pytest.approx([10.0] * 3, rel=1e-2)
        assert np.abs(z_scores(result, arm.robot)).max() < 4.5


def test_what_the_constants_leave_open_shows_in_the_coefficients() -> None:
    arm = simulate(paper_robot(), seed=2)
    noise = arm.white(0.1 * PAPER_NOISE, np.random.default_rng(0))
    open_ = identified(arm, 0.1 * PAPER_NOISE, 0)
    given = identify(arm.robot, [arm.recording(noise)])
    column = open_.structure.names.index("stribeck joint1")
    assert open_.structure.names == given.structure.names
    assert standard_errors(open_)[column] > 1.2 * standard_errors(given)[column]
    assert document(given).friction[0].std.keys() == {"stiction", "stribeck", "viscous", "offset"}
    assert document(open_).friction[0].std.keys() == {"stiction", "stribeck", "viscous", "offset", "k_v", "delta"}


def test_constants_that_the_file_states_are_kept() -> None:
    arm = simulate(paper_robot(), seed=2)
    robot = unknown(arm.robot)
    joints = (replace(robot.joints[0], friction_shape=FrictionShape(k_v=450.0)), *robot.joints[1:])
    noise = arm.white(0.1 * PAPER_NOISE, np.random.default_rng(0))
    result = identify(replace(robot, joints=joints), [arm.recording(noise)])
    first = result.shapes[0]
    assert (first.k_v, first.k_v_given, first.k_v_identifiable, first.delta_given) == (450.0, True, True, False)
    assert (0, "k_v") not in shape_parameters(result.shapes)


@runs(3, 8)
def test_a_stribeck_term_is_found_with_delta_unknown(runs: int) -> None:
    """The paper's truth, K_v stated, δ not: the term is there in every run, and its size is right."""
    arm = simulate(paper_robot(), seed=2)
    robot = with_shapes(arm.robot, 500.0, None)
    for seed in range(runs):
        noise = arm.white(0.2 * PAPER_NOISE, np.random.default_rng(seed))
        result = identify(robot, [arm.recording(noise)])
        assert all(shape.delta is not None for shape in result.shapes)
        assert np.abs(z_scores(result, arm.robot)).max() < 4.5


@pytest.mark.parametrize("k_v", [60.0, *(pytest.param(k_v, marks=pytest.mark.slow) for k_v in (500.0, 5000.0))])
@runs(12, 100)
def test_no_stribeck_term_is_invented(k_v: float, runs: int) -> None:
    arm = simulate(with_shapes(paper_robot(), k_v, 1.0), seed=2, friction=WITHOUT_STRIBECK)
    results = [identified(arm, PAPER_NOISE, seed) for seed in range(runs)]
    invented = [result for result in results if any(shape.delta is not None for shape in result.shapes)]
    assert len(invented) <= 0.02 * runs
    z = np.array([z_scores(result, arm.robot) for result in results if result not in invented])
    assert 0.85 <= rms(z) <= 1.15
    for result in results:
        assert [entry.stribeck for entry in document(result).friction] == [0.0, 0.0, 0.0]
        assert [entry.delta for entry in document(result).friction] == [None, None, None]


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-3, 1e-5])
@runs(3, 10)
def test_a_k_v_between_grid_points_is_not_taken_for_stribeck(noise: float, runs: int) -> None:
    """At a very high signal-to-noise ratio even the error of a fine grid would be significant."""
    for seed, k_v in enumerate(np.geomspace(25.0, 4000.0, runs)):
        arm = simulate(with_shapes(paper_robot(), float(k_v), 1.0), seed=2 + seed % 2, friction=WITHOUT_STRIBECK)
        result = identified(arm, noise, seed)
        assert all(shape.delta is None for shape in result.shapes), k_v
        assert all(shape.k_v_identifiable for shape in result.shapes)
        assert [shape.k_v for shape in result.shapes] == pytest.approx([k_v] * 3, rel=0.02)
        assert np.abs(z_scores(result, arm.robot)).max() < 4.5


@runs(2, 6)
def test_noise_that_hides_the_reversals_leaves_the_constants_open(runs: int) -> None:
    arm = simulate(paper_robot(), seed=2)
    for seed in range(runs):
        result = identified(arm, 20.0, seed)
        for shape, speed in zip(result.shapes, rms_speed(arm), strict=True):
            assert not shape.k_v_identifiable
            assert not shape.delta_identifiable
            assert ORDINARY[0] <= shape.k_v * speed <= ORDINARY[1]
            assert shape.delta is None
        entry = document(result).friction[0]
        assert (entry.identifiable["k_v"], entry.identifiable["delta"]) == (False, False)
        assert "k_v" not in entry.std


@pytest.mark.parametrize("noise", [10.0, 1.0, 1e-2, 1e-4], ids=lambda factor: f"noise x {factor:g}")
@runs(2, 4)
def test_an_ideal_step_does_not_let_the_slope_run_away(noise: float, runs: int) -> None:
    still = [FrictionCoefficients(0.0, 0.0, 0.5)] * 3
    arm = simulate(paper_robot(), seed=2, friction=still)
    level = np.array([2.0, 1.0, 2.0])
    step = level * np.sign(arm.exact.exact.velocity)
    for seed in range(runs):
        result = identified(arm, noise * PAPER_NOISE, seed, step)
        for joint, (shape, speed) in enumerate(zip(result.shapes, rms_speed(arm), strict=True)):
            assert ORDINARY[0] <= shape.k_v * speed <= STEEPEST
            assert not shape.k_v_identifiable
            assert shape.delta is None
            column = result.structure.coefficient(joint, "stiction")
            assert column is not None
            std = standard_errors(result)[column]
            # A smooth step of finite slope stands in for the sign: that misfit is a few thousandths of the level.
            assert abs(result.free_parameters[column] - level[joint]) <= 4.5 * std + 0.02 * level[joint]


@pytest.mark.slow
@pytest.mark.parametrize("level", [0.2, 0.5])
@pytest.mark.parametrize("noise", [1.0, 3.0])
def test_viscous_friction_that_bends_is_not_taken_for_a_gentle_step(level: float, noise: float) -> None:
    """The tail of a gentle step fits friction that grows less than in proportion with speed; the truth has no slope."""
    still = [FrictionCoefficients(0.0, 0.0, 0.5)] * 3
    arm = simulate(paper_robot(), seed=3, friction=still)
    velocity, speed = arm.exact.exact.velocity, rms_speed(arm)
    bent = 2.0 * np.sign(velocity) - level * velocity * np.abs(velocity) / speed**2
    for seed in range(2):
        drawn = arm.white(noise * PAPER_NOISE, np.random.default_rng(seed))
        recording = arm.recording(drawn, extra_torque=bent)
        # So narrow a band blurs every passage through zero: what is left of a slope is its tail.
        result = identify(unknown(arm.robot), [recording], options=Options(cutoff_hz=2.0))
        for shape, own in zip(result.shapes, speed, strict=True):
            assert not shape.k_v_identifiable
            assert shape.delta is None
            assert ORDINARY[0] <= shape.k_v * own <= STEEPEST


@runs(2, 4)
def test_a_gentle_step_is_known_by_the_passage_through_zero(runs: int) -> None:
    """Beside it friction may bend as it likes: the slope of a step that is gentle indeed stays known."""
    arm = simulate(with_shapes(paper_robot(), 25.0, 1.0), seed=2, friction=WITHOUT_STRIBECK)
    for seed in range(runs):
        result = identified(arm, 0.1 * PAPER_NOISE, seed)
        assert all(shape.k_v_identifiable for shape in result.shapes)
        assert [shape.k_v for shape in result.shapes] == pytest.approx([25.0] * 3, rel=0.2)


@runs(3, 8)
def test_a_joint_without_friction_has_none(runs: int) -> None:
    arm = simulate(paper_robot(), seed=2, friction=[FrictionCoefficients()] * 3)
    for seed in range(runs):
        result = identified(arm, PAPER_NOISE, seed)
        assert all(shape.delta is None and not shape.k_v_identifiable for shape in result.shapes)
        assert np.abs(z_scores(result, arm.robot)).max() < 4.5


@pytest.mark.parametrize(
    ("k_v", "delta", "period_s", "seed", "noise"),
    [
        (60.0, 6.0, 20.0, 3, 0.1),
        (100.0, 4.0, 20.0, 3, 0.01),
        (500.0, 10.0, 10.0, 2, 0.001),
    ],
)
@runs(1, 3)
def test_both_slopes_are_right_at_a_high_signal_to_noise_ratio(
    k_v: float, delta: float, period_s: float, seed: int, noise: float, runs: int
) -> None:
    arm = simulate(with_shapes(paper_robot(), k_v, delta), seed=seed, period_s=period_s)
    for run in range(runs):
        result = identified(arm, noise * PAPER_NOISE, run)
        assert [shape.k_v for shape in result.shapes] == pytest.approx([k_v] * 3, rel=0.1)
        assert [shape.delta for shape in result.shapes] == pytest.approx([delta] * 3, rel=0.2)
        assert np.abs(z_scores(result, arm.robot)).max() < 4.5
