"""A robot as plain data: there and back, and errors that name the JSON path."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robot.robot_texts import ROBOT_YAML, URDF, URDF_ROBOT_YAML, write_robot
from tauscope.errors import RobotFileError
from tauscope.robot import Robot, read_robot, robot_from_dict, robot_to_dict
from tauscope.robot.kinematics import link_placements
from tauscope.robot.yaml_text import read_yaml


def _data(text: str = ROBOT_YAML) -> dict[str, Any]:
    return read_yaml(text, "test").data


def _assert_same(first: Robot, second: Robot) -> None:
    assert (first.name, first.joints, first.model.friction) == (second.name, second.joints, second.model.friction)
    np.testing.assert_array_equal(first.gravity, second.gravity)
    q = np.random.default_rng(3).uniform(-2.0, 2.0, (4, first.joint_count))
    np.testing.assert_array_equal(link_placements(first, q), link_placements(second, q))
    assert (first.model.links is None) == (second.model.links is None)
    for one, other in zip(first.model.links or (), second.model.links or (), strict=True):
        np.testing.assert_array_equal(one.to_vector(), other.to_vector())


@pytest.mark.parametrize("text", [ROBOT_YAML, ROBOT_YAML.replace("dh:", "mdh:"), URDF_ROBOT_YAML])
def test_robot_survives_the_way_through_json(tmp_path: Path, text: str) -> None:
    robot = read_robot(write_robot(tmp_path, text, URDF))
    _assert_same(robot, robot_from_dict(json.loads(json.dumps(robot_to_dict(robot)))))


def test_data_of_the_robot_file_give_the_same_robot(tmp_path: Path) -> None:
    _assert_same(read_robot(write_robot(tmp_path, ROBOT_YAML)), robot_from_dict(_data()))


def test_plain_data_open_no_file(tmp_path: Path) -> None:
    data = _data(URDF_ROBOT_YAML)
    data["kinematics"]["urdf"]["file"] = str(write_robot(tmp_path, URDF_ROBOT_YAML, URDF).with_name("arm.urdf"))
    with pytest.raises(RobotFileError, match=r"robot: kinematics\.urdf\.file: .* is not among the given ones"):
        robot_from_dict(data)


def test_segments_are_for_plain_data_and_not_for_the_robot_file(tmp_path: Path) -> None:
    data = robot_to_dict(robot_from_dict(_data()))
    path = write_robot(tmp_path, json.dumps(data))
    with pytest.raises(RobotFileError, match=r"kinematics\.segments: unknown key 'segments'"):
        read_robot(path)


def test_error_names_the_json_path_and_the_joint() -> None:
    data = _data()
    data["joints"][0]["limits"]["position"] = [2.0, 1.0]
    with pytest.raises(RobotFileError) as caught:
        robot_from_dict(data, "request")
    assert str(caught.value).startswith(
        "request: joints[0].limits.position (joint 1, 'shoulder'): lower bound 2 is not"
    )


def test_impossible_body_is_repaired() -> None:
    data = _data()
    data["model"]["links"][1]["mass"] = -1.0
    (warning,) = robot_from_dict(data).warnings
    assert warning.text.startswith("robot: model.links[1] (link 2, 'slide'): mass -1 kg is negative")


@pytest.mark.parametrize(
    ("rotation", "message"),
    [
        ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "three rows"),
        ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]], "not orthonormal"),
        ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]], "mirrors"),
    ],
)
def test_segment_must_hold_a_rotation(rotation: list[list[float]], message: str) -> None:
    data = robot_to_dict(robot_from_dict(_data()))
    data["kinematics"]["segments"][1]["after"]["rotation"] = rotation
    with pytest.raises(RobotFileError, match=rf"segments\[1\]\.after\.rotation \(joint 2, 'slide'\): .*{message}"):
        robot_from_dict(data)


@pytest.mark.parametrize("data", [None, [], "text", 5, {}, {1: 2}, {"name": object()}, {"joints": {"a": set()}}])
def test_any_other_data_are_refused(data: Any) -> None:
    with pytest.raises(RobotFileError, match="robot: "):
        robot_from_dict(data)


def test_drive_nested_without_end_is_refused() -> None:
    data = _data()
    nested: dict[str, Any] = {}
    nested["again"] = nested
    data["joints"][0]["drive"] = nested
    with pytest.raises(RobotFileError, match=r"joints\[0\]\.drive \(joint 1, 'shoulder'\): is nested deeper"):
        robot_from_dict(data)
