"""``python -m tauscope_sim`` and the robot file that comes with it."""

from pathlib import Path

import numpy as np
import pytest

from arms import Array, rotation_z
from tauscope.errors import NotFoundError
from tauscope.robot import read_robot
from tauscope.robot.robot import Robot, Segment
from tauscope_sim.__main__ import main
from tauscope_sim.examples import example_robot


def pose(segment: Segment, angle: float) -> Array:
    """Link frame j seen from link frame j-1: rotation and translation side by side, (3, 4)."""
    turned = segment.before.rotation @ rotation_z(angle)
    position = segment.before.translation + turned @ segment.after.translation
    return np.column_stack([turned @ segment.after.rotation, position])


def test_packaged_paper_arm_is_the_papers(paper: Robot) -> None:
    robot = read_robot(example_robot("paper_arm"))
    assert robot.model.links is not None
    assert paper.model.links is not None
    for link, expected in zip(robot.model.links, paper.model.links, strict=True):
        np.testing.assert_allclose(link.to_vector(), expected.to_vector(), rtol=1e-15)
    for segment, expected in zip(robot.segments, paper.segments, strict=True):
        for angle in (0.0, 0.7):
            np.testing.assert_allclose(pose(segment, angle), pose(expected, angle), atol=1e-15)
    assert robot.model.friction == paper.model.friction
    assert [joint.limits for joint in robot.joints] == [joint.limits for joint in paper.joints]
    assert [joint.friction_shape for joint in robot.joints] == [joint.friction_shape for joint in paper.joints]
    np.testing.assert_array_equal(robot.gravity, [0.0, 0.0, -9.81])


def test_packaged_paper_arm_gives_the_exact_values_of_table_2() -> None:
    """The inertial rows of Table 2, as the paper groups them."""
    links = read_robot(example_robot("paper_arm")).model.links
    assert links is not None
    one, two, three = (link.inertia for link in links)
    moment_two, moment_three = links[1].first_moment, links[2].first_moment
    exact = {
        "Ixx2 - Iyy2 - msx2/2": (two[0, 0] - two[1, 1] - moment_two[0] / 2, 0.059),
        "Ixx3 - Iyy3 - msx3/2": (three[0, 0] - three[1, 1] - moment_three[0] / 2, 0.059),
        "Iyy1 + Iyy2 + Iyy3 + msx2/2 + msx3/2": (
            one[1, 1] + two[1, 1] + three[1, 1] + moment_two[0] / 2 + moment_three[0] / 2,
            -0.118,  # the paper truncates to -0.117
        ),
        "Ixz2 - msz2/2 - msz3/2": (two[0, 2] - moment_two[2] / 2 - moment_three[2] / 2, 0.0),
        "Izz2 + msx2/2": (two[2, 2] + moment_two[0] / 2, -0.059),
        "Izz3 + msx3/2": (three[2, 2] + moment_three[0] / 2, -0.059),
        "m2 + 2 msx2 - 2 msx3": (links[1].mass + 2 * moment_two[0] - 2 * moment_three[0], 1.414),
        "m3 + 2 msx3": (links[2].mass + 2 * moment_three[0], 0.707),
    }
    assert {name: round(float(value), 3) for name, (value, _) in exact.items()} == {
        name: printed for name, (_, printed) in exact.items()
    }


def test_unknown_example_lists_those_there_are() -> None:
    with pytest.raises(NotFoundError, match="'nobody': not there; there are: paper_arm"):
        example_robot("nobody")


def test_command_writes_a_reproducible_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, first, again = str(example_robot("paper_arm")), tmp_path / "first.csv", tmp_path / "again.csv"
    options = ["--seed", "1", "--periods", "2", "--rate", "20", "--noise-std", "0.5", "0.3", "0.7"]
    assert main([robot, "--out", str(first), *options]) == 0
    assert main([robot, "--out", str(again), *options]) == 0
    assert first.read_bytes() == again.read_bytes()
    table = np.loadtxt(first, delimiter=",", skiprows=1)
    assert table.shape == (400, 8)
    assert np.all(np.abs(table[:, 1:4]) <= 2.9)
    assert "400 samples" in capsys.readouterr().out


def test_one_motion_seen_with_different_noise_settings_is_the_same_motion(tmp_path: Path) -> None:
    robot, quiet, noisy = str(example_robot("paper_arm")), tmp_path / "quiet.csv", tmp_path / "noisy.csv"
    assert main([robot, "--out", str(quiet), "--rate", "20"]) == 0
    assert main([robot, "--out", str(noisy), "--rate", "20", "--noise-std", "0.5"]) == 0
    quiet_table, noisy_table = (np.loadtxt(path, delimiter=",", skiprows=1) for path in (quiet, noisy))
    np.testing.assert_array_equal(quiet_table[:, :4], noisy_table[:, :4])
    assert (noisy_table - quiet_table)[:, 4:7].std() == pytest.approx(0.5, rel=0.1)


def test_bad_input_is_one_line_and_status_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taken = tmp_path / "taken.csv"
    taken.touch()
    assert main([str(example_robot("paper_arm")), "--out", str(taken)]) == 1
    assert main([str(tmp_path / "absent.yaml"), "--out", str(tmp_path / "new.csv")]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "taken.csv" in lines[0]
    assert "absent.yaml" in lines[1]


@pytest.mark.parametrize(
    "options", [["--rate", "0"], ["--periods", "none"], ["--harmonics", "1"], ["--noise-std", "-1"], ["--seed", "-1"]]
)
def test_wrong_usage_is_status_2(options: list[str], tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main([str(example_robot("paper_arm")), "--out", str(tmp_path / "new.csv"), *options])
    assert exit_info.value.code == 2
