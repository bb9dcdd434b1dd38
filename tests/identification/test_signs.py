"""Torque that is recorded with the wrong sign is named, joint by joint, and never turned silently."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.poor_motion import poor_arm
from shared_data import SHARED_CASES, SHARED_DATA, needs_shared_cases, needs_shared_data
from tauscope.identification import Identification, document, identify
from tauscope.recording import Recording, read_recording
from tauscope.robot import LinkInertia, Model, Robot, read_robot

SETS = (
    "emps",
    "bam-xl330",
    pytest.param("double-pendulum", marks=pytest.mark.slow),
    *(pytest.param(name, marks=pytest.mark.proof) for name in ("franka-panda", "staubli-tx40")),
)


def turn(robot: Robot, joints: Collection[int]) -> Robot:
    """The robot with the sign of some joints' torque the other way round."""
    signs = (replace(j, sign=-j.sign) if index in joints else j for index, j in enumerate(robot.joints))
    return replace(robot, joints=tuple(signs))


def sign_sets(count: int) -> list[tuple[int, ...]]:
    """None, each joint, and all."""
    return [(), *((joint,) for joint in range(count)), *([tuple(range(count))] if count > 1 else [])]


def assert_named(robot: Robot, recordings: list[Recording], joints: tuple[int, ...]) -> Identification:
    found = identify(turn(robot, joints), recordings)
    assert found.reversed_joints == joints
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, pytest.param(4, marks=pytest.mark.proof)], ids=["three joints", "seven joints"])
def test_each_joint_of_a_simulated_arm_and_all(seed: int, tmp_path: Path) -> None:
    robot, train, _ = poor_arm(seed, "short", tmp_path)
    for joints in sign_sets(robot.joint_count):
        found = assert_named(robot, [train], joints)
        warnings = [each for each in document(found).warnings if each.code == "wrong-sign"]
        assert [each.joint for each in warnings] == [robot.joints[joint].name for joint in joints]
        assert all("`sign: 1`" in (each.remedy or "") for each in warnings)  # the file states -1 there


@needs_shared_data
@pytest.mark.parametrize("name", SETS)
def test_each_joint_of_a_real_arm_and_all(name: str) -> None:
    robot = read_robot(SHARED_DATA / name / "robot.yaml")
    recordings = [read_recording(path) for path in sorted((SHARED_DATA / name).glob("train-*.csv"))]
    for joints in sign_sets(robot.joint_count):
        assert_named(robot, recordings, joints)


def test_torque_far_from_the_stated_masses_is_named(tmp_path: Path) -> None:
    seed = next(seed for seed in range(10) if poor_arm(seed, "short", tmp_path)[0].model.links)
    robot, train, _ = poor_arm(seed, "short", tmp_path)
    assert robot.model.links is not None
    heavy = tuple(LinkInertia.from_vector(10.0 * link.to_vector()) for link in robot.model.links)
    for arm, scale in ((robot, 1.0), (replace(robot, model=Model(links=heavy)), 0.1)):
        found = identify(arm, [train])
        assert found.gravity_scale == pytest.approx(scale, rel=0.5)
        assert ("torque-scale" in {each.code for each in document(found).warnings}) == (scale < 1.0)
        assert not np.isnan(found.parameters).any()


@pytest.mark.slow
@needs_shared_cases
def test_two_joints_of_a_file_as_people_bring_it() -> None:
    robot = read_robot(SHARED_CASES / "ur5" / "ur5.yaml")
    found = identify(robot, [read_recording(SHARED_CASES / "recordings" / "40-two-joints-flipped.csv")])
    assert found.reversed_joints == (1, 3)
