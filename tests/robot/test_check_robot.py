"""The report on a robot file."""

from pathlib import Path

import numpy as np
import pytest

from robot.robot_texts import ROBOT_YAML, URDF, URDF_ROBOT_YAML, replaced, write_robot
from tauscope.errors import RobotFileError
from tauscope.robot import JointType, Severity, check_robot


def test_report_sums_the_arm_up(tmp_path: Path) -> None:
    report = check_robot(write_robot(tmp_path, ROBOT_YAML))
    shoulder, slide = report.joints
    assert (shoulder.number, shoulder.name, shoulder.type, shoulder.mass) == (1, "shoulder", JointType.REVOLUTE, 0.0)
    assert (shoulder.gear_ratio, shoulder.torque_constant, shoulder.sign) == (100.0, 0.5, -1)
    np.testing.assert_allclose(shoulder.origin, [0.2 * np.cos(0.1), 0.2 * np.sin(0.1), 0.3])
    assert shoulder.axis == (0.0, 0.0, 1.0)
    assert (slide.limits.position, slide.mass) == ((0.0, 0.4), 1.4)
    assert report.total_mass == 1.4
    assert report.gravity == (0.0, 0.0, -9.81)
    assert [(f.severity, f.text.split(";")[0]) for f in report.findings] == [
        (Severity.INFO, "no velocity limits for slide")
    ]


def test_axis_of_a_urdf_joint_is_in_the_frame_before(tmp_path: Path) -> None:
    shoulder, elbow = check_robot(write_robot(tmp_path, URDF_ROBOT_YAML, URDF)).joints
    np.testing.assert_allclose(shoulder.axis, [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(shoulder.origin, [0.0, 0.0, 0.3])
    np.testing.assert_allclose(elbow.axis, [0.0, 0.0, -1.0], atol=1e-15)


def test_every_impossible_link_is_listed_first_with_its_repair(tmp_path: Path) -> None:
    text = replaced(ROBOT_YAML, "mass: 1.4", "mass: -1.4").replace("mass: 0,", "mass: -2,")
    report = check_robot(write_robot(tmp_path, text))
    assert [(f.severity, f.text[:8]) for f in report.findings[:2]] == [
        (Severity.WARNING, "mass -2 "),
        (Severity.WARNING, "mass -1."),
    ]
    assert "the nearest body is used: mass -1.4 → 0 kg" in report.findings[1].text
    assert "model.links[0] (link 1, 'shoulder')" in report.findings[0].where


@pytest.mark.parametrize(
    ("old", "new", "where", "text"),
    [
        ("-9.81]", "0]", "gravity", "is 0 m/s², not 9.81"),
        ("viscous: 0.25", "viscous: -0.25", "model friction of joint 2 (slide)", "drives the joint"),
        ("stribeck: -0.3", "stribeck: -3", "model friction of joint 1 (shoulder)", "drives the joint"),
        ("xx: 0, yy: 0", "xx: 1, yy: 1", "model.links[0] (link 1, 'shoulder')", "inertia but no mass"),
    ],
)
def test_what_is_doubtful_is_warned_of(tmp_path: Path, old: str, new: str, where: str, text: str) -> None:
    found = check_robot(write_robot(tmp_path, replaced(ROBOT_YAML, old, new))).findings[0]
    assert found.severity is Severity.WARNING
    assert where in found.where
    assert text in found.text


def test_absent_model_is_mentioned(tmp_path: Path) -> None:
    report = check_robot(write_robot(tmp_path, ROBOT_YAML[: ROBOT_YAML.index("model:")]))
    assert report.total_mass is None
    assert "no links and no friction stated" in report.findings[-1].text


def test_unreadable_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match="no such file"):
        check_robot(tmp_path / "none.yaml")
