"""The columns and units of a file as they are understood, for other tools' files and for our own."""

from pathlib import Path

import pytest

from shared_data import SHARED_CASES, needs_shared_cases
from tauscope.errors import RecordingError
from tauscope.recording import Reading, find_mapping
from tauscope.robot import read_robot

JOINTS = range(1, 7)


@needs_shared_cases
@pytest.mark.parametrize(
    ("name", "is_guessed", "effort", "units"),
    [
        ("30-rtde.csv", True, "tau", {}),
        ("31-franka.csv", True, "tau", {}),
        ("33-plotjuggler.csv", True, "tau", {}),
        ("32-lerobot.parquet", True, "i", {"q": "deg", "tau": "A"}),
        ("39-zero-based.csv", True, "tau", {}),
        ("34-decimal-comma.csv", False, "tau", {}),
    ],
)
def test_every_joint_of_a_known_layout_has_its_columns(
    name: str, is_guessed: bool, effort: str, units: dict[str, str]
) -> None:
    robot = read_robot(SHARED_CASES / "ur5" / "ur5.yaml")
    found = find_mapping(SHARED_CASES / "recordings" / name, robot)
    assert {"t", *(f"{group}{joint}" for group in ("q", effort) for joint in JOINTS)} <= set(found.columns)
    assert set(found.columns.values()) <= set(found.header)
    assert found.is_guessed is is_guessed
    assert found.units == {"t": "s", "q": "rad", "qd": "rad", "tau": "Nm", **units}


def test_a_stated_mapping_is_used_and_a_wrong_one_is_shown_as_far_as_it_goes(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("clock,a,b\n0,1,2\n1,2,3\n", encoding="utf-8")
    stated = find_mapping(path, reading=Reading(columns={"t": "clock", "q1": "a", "tau1": "b"}, units={"t": "ms"}))
    assert (stated.columns, stated.is_guessed) == ({"t": "clock", "q1": "a", "tau1": "b"}, False)
    assert stated.units["t"] == "ms"
    wrong = find_mapping(path, reading=Reading(columns={"t": "clock", "q1": "c", "tau1": "b"}))
    assert (wrong.columns, wrong.is_guessed) == ({}, True)


def test_a_log_has_no_columns_to_map(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(RecordingError, match="names its joints itself"):
        find_mapping(path)
