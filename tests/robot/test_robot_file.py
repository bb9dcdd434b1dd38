"""The robot file: what is read from a valid one."""

from pathlib import Path

import numpy as np
import pytest

from robot.robot_texts import ROBOT_YAML, URDF, URDF_ROBOT_YAML, replaced, write_robot
from shared_data import needs_shared_data
from tauscope.robot import FrictionCoefficients, FrictionShape, Joint, JointLimits, JointType, Robot, read_robot
from tauscope.robot.kinematics import link_placements


def _read(folder: Path, text: str, urdf: str | None = None) -> Robot:
    return read_robot(write_robot(folder, text, urdf))


def test_every_field_is_read(tmp_path: Path) -> None:
    robot = _read(tmp_path, ROBOT_YAML)
    assert robot.name == "two-joint-arm"
    assert robot.source == tmp_path / "arm.yaml"
    assert robot.joints[0] == Joint(
        name="shoulder",
        limits=JointLimits((-2.9, 2.9), 2.0, 5.0, 40.0),
        gear_ratio=100.0,
        torque_constant=0.5,
        has_torque_constant=True,
        sign=-1,
        friction_shape=FrictionShape(500.0, 10.0),
        drive={"bus": "can0", "node": 3},
    )
    assert robot.joints[1] == Joint("slide", JointType.PRISMATIC, JointLimits((0.0, 0.4)))
    assert robot.model.friction == (FrictionCoefficients(2.0, -0.3, 0.5), FrictionCoefficients(1.0, -0.2, 0.25))
    assert robot.model.links is not None
    np.testing.assert_array_equal(
        robot.model.links[1].to_vector(), [0.02, 0.03, 0.03, 0.0, 0.0, 0.0, 1.4, 0.1, 0.0, 0.0]
    )
    assert robot.findings == ()


def test_path_may_be_text(tmp_path: Path) -> None:
    assert read_robot(str(write_robot(tmp_path, ROBOT_YAML))).joint_count == 2


def test_defaults_are_those_of_the_contract(tmp_path: Path) -> None:
    robot = _read(tmp_path, "name: a\nkinematics:\n  mdh: [{theta: 0, d: 1, a: 0, alpha: 0}]\n")
    np.testing.assert_array_equal(robot.gravity, [0.0, 0.0, -9.81])
    assert robot.joints == (Joint("joint1"),)
    assert robot.model.links is None
    assert robot.model.friction is None
    assert robot.urdf is None


def test_standard_and_modified_rows_mean_different_arms(tmp_path: Path) -> None:
    standard = _read(tmp_path, ROBOT_YAML)
    modified = _read(tmp_path, replaced(ROBOT_YAML, "dh:", "mdh:"))
    q = np.zeros((1, 2))
    x, y = 0.2 * np.cos(0.1), 0.2 * np.sin(0.1)
    np.testing.assert_allclose(link_placements(standard, q)[0, 0, :3, 3], [x, y, 0.3])
    np.testing.assert_allclose(link_placements(modified, q)[0, 0, :3, 3], [0.2, -0.3, 0.0], atol=1e-7)


def test_urdf_beside_the_robot_file_fills_joints_and_model(tmp_path: Path) -> None:
    robot = _read(tmp_path, URDF_ROBOT_YAML, URDF)
    assert robot.urdf == tmp_path / "arm.urdf"
    assert [joint.name for joint in robot.joints] == ["shoulder", "elbow"]
    assert robot.joints[0].limits == JointLimits((-2.0, 2.0), 1.5, None, 30.0)
    assert robot.link_names == (("upper",), ("lower", "tool"))
    assert robot.model.links is not None
    assert robot.model.links[0].mass == 2.0
    np.testing.assert_allclose(robot.model.links[0].first_moment, [0.2, 0.0, 0.0])
    assert robot.model.friction == (FrictionCoefficients(0.2, 0.0, 0.5), FrictionCoefficients())


def test_limits_of_the_robot_file_go_before_the_urdfs(tmp_path: Path) -> None:
    joints = "joints:\n  - {name: shoulder, limits: {velocity: 0.7}}\n  - name: elbow\n"
    robot = _read(tmp_path, URDF_ROBOT_YAML + joints, URDF)
    assert robot.joints[0].limits == JointLimits((-2.0, 2.0), 0.7, None, 30.0)


def test_joints_are_matched_by_name_and_those_not_listed_take_the_urdfs_values(tmp_path: Path) -> None:
    robot = _read(tmp_path, URDF_ROBOT_YAML + "joints:\n  - {name: elbow, gear_ratio: 50}\n", URDF)
    assert [(joint.name, joint.gear_ratio) for joint in robot.joints] == [("shoulder", None), ("elbow", 50.0)]
    assert robot.joints[0].limits.torque == 30.0


def test_urdf_by_itself_is_a_robot_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF, encoding="utf-8")
    robot = read_robot(path)
    assert (robot.name, robot.source, robot.urdf) == ("two-joint-arm", path, path)
    assert [joint.name for joint in robot.joints] == ["shoulder", "elbow"]
    (note,) = robot.warnings
    assert note.code == "default-chain"
    assert "from 'base' to the deepest leaf 'tool'; its joints are 'shoulder', 'elbow'" in note.text
    assert "kinematics: {urdf: {file: arm.urdf, base: …, tip: …}}" in str(note.remedy)


def test_base_and_tip_may_be_left_out(tmp_path: Path) -> None:
    robot = _read(tmp_path, "name: a\nkinematics: {urdf: {file: arm.urdf}}\n", URDF)
    assert [note.code for note in robot.warnings] == ["default-chain"]


def test_model_block_replaces_all_of_the_urdfs_model(tmp_path: Path) -> None:
    friction = "{stiction: 1, stribeck: 0, viscous: 2}"
    model = f"model:\n  friction: [{friction}, {friction}]\n"
    robot = _read(tmp_path, URDF_ROBOT_YAML + model, URDF)
    assert robot.model.links is None
    assert robot.model.friction == (FrictionCoefficients(1.0, 0.0, 2.0),) * 2


def test_impossible_urdf_inertial_matters_not_where_the_model_block_replaces_it(tmp_path: Path) -> None:
    friction = "{stiction: 1, stribeck: 0, viscous: 2}"
    model = f"model:\n  friction: [{friction}, {friction}]\n"
    robot = _read(tmp_path, URDF_ROBOT_YAML + model, replaced(URDF, 'izz="0.04"', 'izz="0.4"'))
    assert robot.findings == ()
    assert robot.warnings == ()


def test_aliases_and_byte_order_mark_are_accepted(tmp_path: Path) -> None:
    text = "\ufeff" + ROBOT_YAML.replace("{position: [-2.9, 2.9]", "{position: &all [-2.9, 2.9]")
    robot = _read(tmp_path, text.replace("{position: [0.0, 0.4]}", "{position: *all}"))
    assert robot.joints[1].limits.position == (-2.9, 2.9)


@pytest.mark.parametrize(("text", "value"), [("1e-1", 0.1), ("0x10", 16.0), ("+3", 3.0), (".5", 0.5), ("1_0", 10.0)])
def test_numbers_of_yaml_are_read(tmp_path: Path, text: str, value: float) -> None:
    robot = _read(tmp_path, replaced(ROBOT_YAML, "gear_ratio: 100", f"gear_ratio: {text}"))
    assert robot.joints[0].gear_ratio == value


def test_null_is_not_stated(tmp_path: Path) -> None:
    robot = _read(tmp_path, replaced(ROBOT_YAML, "velocity: 2.0", "velocity: null"))
    assert robot.joints[0].limits.velocity is None


def test_names_that_look_like_dates_or_yes_are_text(tmp_path: Path) -> None:
    assert _read(tmp_path, replaced(ROBOT_YAML, "two-joint-arm", "2026-11-21")).name == "2026-11-21"
    assert _read(tmp_path, replaced(ROBOT_YAML, "two-joint-arm", "yes")).name == "yes"


@needs_shared_data
@pytest.mark.parametrize(
    ("name", "joints", "kind"),
    [
        ("bam-xl330", 1, "revolute"),
        ("double-pendulum", 2, "revolute"),
        ("emps", 1, "prismatic"),
        ("franka-panda", 7, "revolute"),
        ("kuka-lwr4", 7, "revolute"),
        ("odrive-cogging", 1, "revolute"),
        ("staubli-tx40", 6, "revolute"),
    ],
)
def test_robot_files_of_real_arms_are_read(shared_data: Path, name: str, joints: int, kind: str) -> None:
    robot = read_robot(shared_data / name / "robot.yaml")
    assert robot.joint_count == len(robot.segments) == joints
    assert {joint.type.value for joint in robot.joints} == {kind}
    if robot.urdf is not None:
        assert robot.model.links is not None
        assert all(link.mass > 0.0 for link in robot.model.links)
