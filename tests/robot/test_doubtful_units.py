"""Descriptions of robots that are not in SI units: a warning names the quantity; sound ones have none."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tauscope.errors import RobotFileError
from tauscope.robot import read_robot

LINK = """
<link name="l{k}"><inertial><origin xyz="0.2 0 0"/><mass value="3"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{k}" type="revolute"><parent link="{parent}"/><child link="l{k}"/><origin xyz="0.4 0 0"/>
<axis xyz="0 0 1"/><limit lower="-6.3" upper="6.3" effort="50" velocity="3"/></joint>"""
ARM = f'<robot name="arm"><link name="base"/>{LINK.format(k=1, parent="base")}{LINK.format(k=2, parent="l1")}</robot>'


def scale(pattern: str, factor: float) -> str:
    """The arm with every number behind an attribute times a factor."""

    def change(match: re.Match[str]) -> str:
        return match[1] + " ".join(str(float(number) * factor) for number in match[2].split()) + '"'

    return re.sub(f'({pattern}=")([^"]*)"', change, ARM)


DESCRIPTIONS: dict[str, Callable[[], str]] = {
    "limits in rad": lambda: scale("(?:lower|upper)", 57.3),
    "lengths in m": lambda: scale("<origin xyz", 1000.0),
    "masses in kg": lambda: scale("<mass value", 1000.0),
}


@pytest.mark.parametrize("quantity", DESCRIPTIONS)
def test_a_quantity_that_is_not_in_si_is_named(tmp_path: Path, quantity: str) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(DESCRIPTIONS[quantity](), encoding="utf-8")
    notes = [note for note in read_robot(path).notes if note.code == "doubtful-units"]
    assert [note.remedy for note in notes] == [f"state {quantity} in the robot's description"]
    path.write_text(ARM, encoding="utf-8")
    assert "doubtful-units" not in {note.code for note in read_robot(path).notes}


@pytest.mark.parametrize("key", ["theta", "alpha"])
def test_degrees_of_denavit_and_hartenberg_are_refused(tmp_path: Path, key: str) -> None:
    row = {"theta": 0.0, "d": 0.1, "a": 0.2, "alpha": 0.0} | {key: 90}
    path = tmp_path / "arm.yaml"
    path.write_text(f"name: arm\nkinematics: {{dh: [{row}]}}\n".replace("'", ""), encoding="utf-8")
    with pytest.raises(RobotFileError, match=rf"{key} \(joint 1\): is 90 rad, beyond a turn; 90° are 1.5708"):
        read_robot(path)
