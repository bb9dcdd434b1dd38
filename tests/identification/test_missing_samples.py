"""Recordings as they come: samples missed, gaps, jitter, sliding joints, arms of any length."""

import numpy as np
import pytest
from numpy.typing import NDArray

from arms import random_arm, random_parameters
from identification.simulated import (
    PAPER_NOISE,
    Array,
    SimulatedArm,
    paper_robot,
    rms,
    simulate,
    standard_errors,
    true_parameters,
    with_limits,
    with_model,
    with_shapes,
    z_scores,
)
from tauscope.identification import Identification, document, identify
from tauscope.identification.result import ConditioningEntry
from tauscope.recording import EffortKind, Recording
from tauscope.robot import FrictionCoefficients, Joint, Robot
from tauscope_sim.friction import static_friction_torque
from tauscope_sim.model import build_model
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import rigid_body_torque

Mask = NDArray[np.bool_]

BOUND = 4.5
"""Standard errors within which every parameter has to lie: one in 150 would fail by chance among a thousand."""


@pytest.fixture(scope="module")
def arm() -> SimulatedArm:
    return simulate(paper_robot(), seed=2)


def damaged(
    arm: SimulatedArm, seed: int, *, periods: bool = True, position: Mask | None = None, torque: Mask | None = None
) -> Recording:
    """The arm's noisy recording with NaN where a mask (N, n) or (N,) says so."""
    exact = arm.exact
    q, tau = exact.exact.position.copy(), exact.torque_exact + arm.white(PAPER_NOISE, np.random.default_rng(seed))
    if position is not None:
        q[position] = np.nan
    if torque is not None:
        tau[torque] = np.nan
    period = exact.period.astype(float) if periods else None
    return Recording.from_arrays("damaged", exact.time, q, tau, period=period)


def conditioning(result: Identification) -> ConditioningEntry:
    (entry,) = document(result).conditioning
    return entry


def assert_within_errors(results: list[Identification], robot: Robot) -> None:
    z = np.array([z_scores(result, robot) for result in results])
    assert np.abs(z).max() < BOUND
    assert rms(z) < 1.2


@pytest.mark.parametrize("periods", [True, False], ids=["periods", "one motion"])
def test_missed_torques_are_masked_and_counted(arm: SimulatedArm, periods: bool) -> None:
    results = []
    for seed in range(10):
        missed = np.random.default_rng(100 + seed).random(arm.exact.torque_exact.shape) < [0.05, 0.0, 0.2]
        results.append(identify(arm.robot, [damaged(arm, seed, periods=periods, torque=missed)]))
        entry = conditioning(results[-1])
        assert entry.missed_torques == list(missed.sum(axis=0))
        assert (entry.missed_positions, entry.gaps, entry.dropped) == (0, 0, 0)
        assert entry.samples == len(missed)
    assert_within_errors(results, arm.robot)


def test_missed_torques_cost_what_they_are_worth(arm: SimulatedArm) -> None:
    """Half of joint 3's torque missed: what only joint 3 tells is known √2 times worse, the rest no worse."""
    missed = np.zeros(arm.exact.torque_exact.shape, dtype=bool)
    missed[:, 2] = np.random.default_rng(1).random(len(missed)) < 0.5
    half = identify(arm.robot, [damaged(arm, 0, torque=missed)])
    whole = identify(arm.robot, [damaged(arm, 0)])
    ratio = dict(zip(half.structure.names, standard_errors(half) / standard_errors(whole), strict=True))
    assert ratio["stribeck joint3"] == pytest.approx(np.sqrt(2.0), rel=0.08)
    assert ratio["stribeck joint1"] == pytest.approx(1.0, rel=0.05)


def test_a_whole_block_of_torque_missed_at_one_joint(arm: SimulatedArm) -> None:
    results = []
    for seed in range(6):
        missed = np.zeros(arm.exact.torque_exact.shape, dtype=bool)
        missed[400:900, 1] = True
        results.append(identify(arm.robot, [damaged(arm, seed, periods=False, torque=missed)]))
        assert conditioning(results[-1]).missed_torques == [0, 500, 0]
    assert_within_errors(results, arm.robot)


def test_a_torque_never_measured_at_one_joint_is_refused_by_its_name(arm: SimulatedArm) -> None:
    missed = np.zeros(arm.exact.torque_exact.shape, dtype=bool)
    missed[:, 1] = True
    with pytest.raises(ValueError, match=r"joint2: 0 usable samples"):
        identify(arm.robot, [damaged(arm, 0, torque=missed)])


@pytest.mark.parametrize("periods", [True, False], ids=["periods", "one motion"])
def test_missed_positions_are_bridged_and_counted(arm: SimulatedArm, periods: bool) -> None:
    results = []
    for seed in range(8):
        rows = np.random.default_rng(200 + seed).random(len(arm.exact.time)) < 0.02
        rows[:5] = rows[-5:] = False
        missed = np.zeros(arm.exact.torque_exact.shape, dtype=bool)
        missed[rows, seed % 3] = True
        results.append(identify(arm.robot, [damaged(arm, seed, periods=periods, position=missed)]))
        entry = conditioning(results[-1])
        assert entry.missed_positions == rows.sum()
        assert entry.samples == len(rows)
    assert_within_errors(results, arm.robot)


@pytest.mark.parametrize("as_nan", [True, False], ids=["NaN", "rows left out"])
def test_long_gaps_split_the_recording(arm: SimulatedArm, as_nan: bool) -> None:
    results = []
    for seed in range(6):
        recording = damaged(arm, seed, periods=False)
        samples = recording.samples()
        gone = np.zeros(len(recording), dtype=bool)
        gone[700:760] = gone[1900:1990] = True
        if as_nan:
            recording = damaged(arm, seed, periods=False, position=np.tile(gone[:, None], (1, 3)))
        else:
            kept = ~gone
            recording = Recording.from_arrays("cut", samples.time[kept], samples.position[kept], samples.effort[kept])
        results.append(identify(arm.robot, [recording]))
        entry = conditioning(results[-1])
        assert entry.gaps == 2
        assert entry.missed_positions == (150 if as_nan else 0)
        assert entry.samples == (3000 if as_nan else 2850)
    assert_within_errors(results, arm.robot)


def test_pieces_too_short_to_use_are_dropped_and_counted(arm: SimulatedArm) -> None:
    gone = np.zeros(len(arm.exact.time), dtype=bool)
    gone[1000:1040] = gone[1060:1100] = True  # 20 samples between two gaps
    position = np.tile(gone[:, None], (1, 3))
    result = identify(arm.robot, [damaged(arm, 0, periods=False, position=position)])
    entry = conditioning(result)
    assert (entry.gaps, entry.dropped, entry.missed_positions) == (2, 20, 80)
    assert_within_errors([result], arm.robot)


def evaluated_at(arm: SimulatedArm, seed: int, time: Array) -> tuple[Array, Array]:
    """Exact position and torque of the arm's motion at any instants."""
    motion = random_fourier_motion(arm.robot.joints, np.random.default_rng(seed))
    samples = motion.evaluate(time)
    friction, shapes = arm.robot.model.friction, [joint.friction_shape for joint in arm.robot.joints]
    assert friction is not None
    torque = rigid_body_torque(build_model(arm.robot), samples.position, samples.velocity, samples.acceleration)
    return samples.position, torque + static_friction_torque(samples.velocity, friction, shapes)


def test_jittering_stamps_are_resampled(arm: SimulatedArm) -> None:
    """Stamps that are true but not uniform; friction's steps are wide enough for a spline to follow."""
    soft = simulate(with_shapes(arm.robot, 60.0, 6.0), seed=2)
    results = []
    for seed in range(8):
        rng = np.random.default_rng(300 + seed)
        time = (np.arange(6000) + rng.uniform(-0.2, 0.2, 6000)) / 200.0
        position, torque = evaluated_at(soft, 2, time)
        noisy = torque + PAPER_NOISE * rng.standard_normal(torque.shape)
        results.append(identify(soft.robot, [Recording.from_arrays("jitter", time, position, noisy)]))
        entry = conditioning(results[-1])
        assert entry.resampled
        assert entry.rate_hz == pytest.approx(200.0, rel=0.01)
    assert_within_errors(results, soft.robot)


def test_uniform_stamps_are_not_resampled(arm: SimulatedArm) -> None:
    assert not conditioning(identify(arm.robot, [damaged(arm, 0)])).resampled


def random_truth(seed: int, joint_count: int) -> SimulatedArm:
    """A random chain of turning and sliding joints with random bodies and friction, on a random motion."""
    rng = np.random.default_rng(seed)
    robot = with_shapes(with_limits(random_arm(rng, joint_count), 2.5, 2.0, 8.0), 300.0, 8.0)
    friction = [
        FrictionCoefficients(float(rng.uniform(0.5, 3.0)), -float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.1, 1.0)))
        for _ in range(joint_count)
    ]
    return simulate(with_model(robot, random_parameters(rng, joint_count), friction), seed=seed)


@pytest.mark.parametrize("joint_count", range(1, 8))
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 8))])
def test_random_arms_of_one_to_seven_joints(seed: int, joint_count: int) -> None:
    arm = random_truth(1000 * joint_count + seed, joint_count)
    noise = np.linspace(0.2, 0.6, joint_count)
    result = identify(arm.robot, [arm.recording(arm.white(noise, np.random.default_rng(seed)))])
    assert not any(terms.rotor for terms in result.structure.terms)
    determined = ~result.undetermined
    z = z_scores(result, arm.robot)[determined]
    assert np.abs(z).max() < BOUND
    assert rms(z) < 1.0 + 4.0 / np.sqrt(2.0 * len(z)) + 0.1
    np.testing.assert_allclose(result.residuals.noise_std, noise, rtol=0.08)
    assert len(document(result).links) == joint_count


def test_a_sliding_and_turning_arm_names_its_parameters(arm: SimulatedArm) -> None:
    """Whatever the arm, the truth of every combination comes from its own terms."""
    cranes = random_truth(7, 4)
    result = identify(cranes.robot, [cranes.recording()])
    truth = true_parameters(result, cranes.robot)
    scale = np.maximum(np.abs(truth), 1.0)
    determined = ~result.undetermined
    assert (np.abs(result.free_parameters - truth) / scale)[determined].max() < 1e-6


def test_sign_and_torque_constant_turn_drive_units_into_torque(arm: SimulatedArm) -> None:
    """The same data as current with a wrong-way joint: the same parameters, in Nm."""
    constants, signs = np.array([2.0, 0.5, 10.0]), np.array([1, -1, 1])
    joints = tuple(
        Joint(joint.name, joint.type, joint.limits, None, float(constant), int(sign), joint.friction_shape)
        for joint, constant, sign in zip(arm.robot.joints, constants, signs, strict=True)
    )
    robot = Robot(arm.robot.name, joints, arm.robot.segments, arm.robot.gravity, arm.robot.model)
    plain = damaged(arm, 0)
    samples = plain.samples()
    current = Recording.from_arrays(
        "current",
        samples.time,
        samples.position,
        samples.effort * signs / constants,
        effort_kind=EffortKind.CURRENT,
        period=samples.period,
    )
    expected, found = identify(arm.robot, [plain]), identify(robot, [current])
    np.testing.assert_allclose(found.free_parameters, expected.free_parameters, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.residuals.noise_std, expected.residuals.noise_std, rtol=1e-9)
