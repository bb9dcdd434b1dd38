"""Reflected rotor inertia: found where it shows, never invented, never at a joint where links can imitate it."""

from dataclasses import replace

import numpy as np
import pytest

from arms import arm as arm_from_segments
from arms import dh_segment, panda_like, paper_arm, random_arm, random_parameters, random_states, ur5_like
from identification.simulated import (
    PAPER_NOISE,
    Array,
    SimulatedArm,
    paper_robot,
    runs,
    simulate,
    with_limits,
    with_model,
    with_shapes,
    z_scores,
)
from pinocchio_arm import pinocchio_regressor
from tauscope.dynamics import base_parameters
from tauscope.identification import Identification, Options, document, identify
from tauscope.identification.rotor import separable_rotors
from tauscope.robot import JointType, Robot


@pytest.fixture(scope="module")
def arm() -> SimulatedArm:
    return simulate(paper_robot(), seed=2)


def rotors_of(result: Identification) -> list[bool]:
    return [terms.rotor for terms in result.structure.terms]


def with_rotors(arm: SimulatedArm, inertia: list[float], seed: int, noise: Array = PAPER_NOISE) -> Identification:
    """The arm with I_a q̈_j more torque at every joint, identified."""
    extra = np.array(inertia) * arm.exact.exact.acceleration
    recording = arm.recording(arm.white(noise, np.random.default_rng(seed)), extra_torque=extra)
    return identify(arm.robot, [recording])


def imitated(robot: Robot, joint: int) -> bool:
    """Whether I_a q̈_j lies in the span of Pinocchio's columns, offsets and viscous friction, by their rank."""
    count = robot.joint_count
    q, qd, qdd = random_states(np.random.default_rng(77), 60, count)
    own = np.zeros((len(q), count, count, 2))
    for other in range(count):
        own[:, other, other] = np.stack([np.ones(len(q)), qd[:, other]], axis=1)
    phi = np.concatenate([pinocchio_regressor(robot, q, qd, qdd), own.reshape(len(q), count, -1)], axis=2)
    phi = phi.reshape(len(q) * count, -1)
    phi /= np.maximum(np.linalg.norm(phi, axis=0), 1e-300)
    column = np.zeros_like(q)
    column[:, joint] = qdd[:, joint]
    flat = column.ravel()
    left, singular, _ = np.linalg.svd(phi, full_matrices=False)
    basis = left[:, singular > 1e-9 * singular[0]]
    return bool(np.linalg.norm(flat - basis @ (basis.T @ flat)) < 1e-6 * np.linalg.norm(flat))


@runs(8, 100)
def test_no_rotor_is_invented(arm: SimulatedArm, runs: int) -> None:
    found = [rotors_of(with_rotors(arm, [0.0, 0.0, 0.0], seed)) for seed in range(runs)]
    assert not np.any(found)


@runs(4, 10)
def test_the_last_joints_rotor_is_found(arm: SimulatedArm, runs: int) -> None:
    rotors = [0.0, 0.0, 0.15]
    for seed in range(runs):
        result = with_rotors(arm, rotors, seed)
        assert rotors_of(result) == [False, False, True]
        assert np.abs(z_scores(result, arm.robot, rotors)).max() < 4.5
        (entry,) = document(result).rotor_inertia
        assert entry.joint == "joint3"
        assert entry.std is not None
        assert abs(entry.value - 0.15) < 4.5 * entry.std


def test_its_size_is_within_its_errors_on_better_data(arm: SimulatedArm) -> None:
    result = with_rotors(arm, [0.0, 0.0, 0.02], 1, 0.05 * PAPER_NOISE)
    (entry,) = document(result).rotor_inertia
    assert entry.std is not None
    assert entry.std < 0.002
    assert abs(entry.value - 0.02) < 4.5 * entry.std


def test_a_rotor_that_links_imitate_is_theirs(arm: SimulatedArm) -> None:
    """At joints 1 and 2 the rotor is one with Iyy1 + … and Izz2 + …: it shows there and not as a term of its own."""
    rotors = [0.2, 0.1, 0.0]
    for seed in range(5):
        result = with_rotors(arm, rotors, seed)
        assert rotors_of(result) == [False, False, False]
        shift = np.zeros(result.structure.size)
        for place, terms in enumerate(result.structure.base.terms):
            shift[place] = rotors[0] * ("Iyy1" in terms) + rotors[1] * (list(terms) == ["Izz2", "msx2"])
        z = z_scores(result, arm.robot) - shift / np.sqrt(np.diag(result.covariance)[: result.structure.size])
        assert np.abs(z).max() < 4.5


def test_rotors_are_left_out_on_demand(arm: SimulatedArm) -> None:
    extra = np.array([0.0, 0.0, 0.15]) * arm.exact.exact.acceleration
    recording = arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(0)), extra_torque=extra)
    assert rotors_of(identify(arm.robot, [recording], options=Options(rotor_inertia=False))) == [False] * 3


@pytest.mark.parametrize("robot", [paper_arm(), ur5_like(), panda_like()], ids=lambda robot: robot.name)
def test_separable_rotors_of_known_arms(robot: Robot) -> None:
    separable = separable_rotors(robot, base_parameters(robot))
    assert separable == tuple(not imitated(robot, joint) for joint in range(robot.joint_count))
    assert not separable[0]


@pytest.mark.parametrize("seed", range(12))
def test_separable_rotors_of_any_arm(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_arm(rng, 1 + seed % 7)
    separable = separable_rotors(robot, base_parameters(robot))
    assert separable == tuple(not imitated(robot, joint) for joint in range(robot.joint_count))


@pytest.mark.parametrize("seed", range(4))
def test_no_rotor_where_it_is_aliased_on_a_random_arm(seed: int) -> None:
    """Six joints, a rotor at every one: those that are terms of their own are the separable ones, and right."""
    rng = np.random.default_rng(seed)
    robot = with_limits(random_arm(rng, 6), 2.5, 2.0, 6.0)
    arm = simulate(with_model(robot, random_parameters(rng, 6)), seed=seed)
    truth = [0.8] * 6
    result = with_rotors(arm, truth, seed, np.full(6, 0.05))
    found = rotors_of(result)
    separable = separable_rotors(robot, result.structure.base)
    assert all(ours <= allowed for ours, allowed in zip(found, separable, strict=True))
    assert found == list(separable)
    std = np.sqrt(np.diag(result.covariance))
    for joint, has_rotor in enumerate(found):
        column = result.structure.coefficient(joint, "rotor_inertia")
        if has_rotor and column is not None:
            assert abs(result.free_parameters[column] - truth[joint]) < 4.5 * std[column]


def test_no_rotor_on_a_vertical_axis_where_mass_and_offset_imitate_it() -> None:
    """An arm on a lift: τ1 = (m + I_a) q̈ + m g + offset. I_a is separable from the links, but not beside an offset."""
    rows = [
        dh_segment(0.0, 0.0, 0.0, np.pi / 2, JointType.PRISMATIC),
        dh_segment(0.0, 0.0, 0.4, 0.0),
        dh_segment(0.0, 0.0, 0.4, 0.0),
    ]
    robot = with_model(
        with_limits(arm_from_segments("lift", rows), 1.0, 1.5, 5.0), random_parameters(np.random.default_rng(0), 3)
    )
    arm = simulate(with_shapes(robot, 500.0, 10.0), seed=1)
    result = with_rotors(arm, [0.0, 0.0, 0.3], 0, np.full(3, 0.05))
    assert rotors_of(result) == [False, False, True]
    assert not result.undetermined.any()
    assert np.abs(z_scores(result, arm.robot, [0.0, 0.0, 0.3])).max() < 4.5


@runs(6, 20)
def test_a_stated_gear_ratio_lowers_the_bar_but_invents_nothing(arm: SimulatedArm, runs: int) -> None:
    """The gear says that there is a rotor; where none shows, an estimate of two standard errors is rare and honest."""
    robot = replace(arm.robot, joints=tuple(replace(joint, gear_ratio=100.0) for joint in arm.robot.joints))
    for seed in range(runs):
        result = identify(robot, [arm.recording(arm.white(PAPER_NOISE, np.random.default_rng(seed)))])
        assert rotors_of(result)[:2] == [False, False]
        assert np.abs(z_scores(result, arm.robot)).max() < 4.5
