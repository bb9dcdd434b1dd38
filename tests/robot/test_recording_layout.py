"""The robot file's block about units of recordings."""

from pathlib import Path

import pytest

from robot.robot_texts import ROBOT_YAML, write_robot
from tauscope.errors import RobotFileError
from tauscope.robot import RecordingLayout, read_robot, robot_from_dict, robot_to_dict


def test_units_and_rate_are_read_and_kept(tmp_path: Path) -> None:
    block = "recording: {units: {t: index, q: deg, q2: mm, tau: mA}, rate_hz: 500}\n"
    robot = read_robot(write_robot(tmp_path, ROBOT_YAML + block))
    layout = RecordingLayout({"t": "index", "q": "deg", "q2": "mm", "tau": "mA"}, 500.0)
    assert robot.recording == layout
    assert robot_from_dict(robot_to_dict(robot)).recording == layout
    assert read_robot(write_robot(tmp_path, ROBOT_YAML)).recording == RecordingLayout()


def test_whether_a_torque_constant_is_stated_is_kept(tmp_path: Path) -> None:
    robot = read_robot(write_robot(tmp_path, ROBOT_YAML))
    assert [joint.has_torque_constant for joint in robot.joints] == [True, False]
    again = robot_from_dict(robot_to_dict(robot))
    assert [joint.has_torque_constant for joint in again.joints] == [True, False]


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ("{units: {t: h}}", "'h' is no unit of t; use s, ms, us, ns, min, index"),
        ("{units: {x: deg}}", "'x' has no unit to choose; name t, q, qd or tau, or one joint's column, as in q3"),
        ("{units: {tau2: mA}}", "'tau2' has no unit to choose"),
        ("{units: {t: index}}", "t counts samples: state their rate, too"),
        ("{rate_hz: 500}", "a rate needs t=index"),
        ("{rate_hz: 0}", "must be above zero"),
        ("{columns: rdte}", "'rdte' is no preset; use rtde, libfranka"),
        ("{columns: {x1: a}}", "'x1' is no column of a recording; use t, q, tau"),
        ("{columns: {q: 2}}", "q has one column a joint; list them"),
        ("{columns: {t: [a, b, c]}}", "t is one column"),
        ("{columns: {q1: 1.5}}", "1.5 is no column; write its name, or its number from 1"),
        ("{columns: {q: []}}", "must not be empty"),
        ("{decimal: '-'}", "'-' is no decimal sign"),
        ("{delimiter: x}", "'x' separates no fields"),
        ("{delimiter: ',', decimal: ','}", "decimal sign and delimiter at once"),
        ("{unit: {t: ms}}", "unknown key 'unit'; did you mean 'units'?"),
    ],
)
def test_what_is_not_known_is_refused(tmp_path: Path, block: str, words: str) -> None:
    with pytest.raises(RobotFileError) as caught:
        read_robot(write_robot(tmp_path, f"{ROBOT_YAML}recording: {block}\n"))
    assert words in str(caught.value)
    assert "recording" in str(caught.value)
