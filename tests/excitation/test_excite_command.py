"""``tauscope excite``: what it writes, what it shows, how it ends."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from excitation.excited_arms import short_search
from tauscope.cli.program import main
from tauscope.robot import read_robot
from tauscope.trajectory import read_trajectory, trajectory_json
from tauscope.trajectory.document import TrajectoryDocument, trajectory_of
from tauscope_sim.examples import example_robot

ROBOT = str(example_robot("paper_arm"))
QUICK = ["--periods", "2", "--harmonics", "3", "--duration", "6", "--no-slow-reversals"]


@pytest.fixture(scope="module", autouse=True)
def _short_search() -> Iterator[None]:
    with short_search():
        yield


def test_design_and_samples_are_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, csv = tmp_path / "design.json", tmp_path / "motion.csv"
    assert main(["excite", ROBOT, *QUICK, "--seed", "1", "--json", str(out), "--csv", str(csv), "--rate", "50"]) == 0
    shown = capsys.readouterr().out
    assert "condition number" in shown
    assert "Limited by" in shown
    assert f"wrote {out}" in shown
    document = json.loads(out.read_text())
    assert document["schema"] == "tauscope.excitation/1"
    assert document["period_s"] == 6.0
    assert document["periods"] == 2
    robot = read_robot(ROBOT)
    played = read_trajectory(out, robot)
    inside = trajectory_of(TrajectoryDocument.model_validate(document["trajectory"], strict=False))
    assert trajectory_json(played) == trajectory_json(inside)
    samples = read_trajectory(csv, robot).samples(50.0)
    np.testing.assert_allclose(samples.position, played.samples(50.0).position, atol=1e-12)


def test_json_on_standard_output_stands_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["excite", ROBOT, *QUICK, "--no-closing-period", "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["duration_s"] == pytest.approx(12.0)
    assert [segment["kind"] for segment in document["trajectory"]["segments"]] == ["fourier"]


def test_a_floor_above_the_arm_is_one_line_and_status_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["excite", ROBOT, "--floor", "2"]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "the floor meet in every posture" in error


@pytest.mark.parametrize(
    "words",
    [
        ["--box", "1,2"],
        ["--box", "a,b,c,d,e,f"],
        ["--tool", "1,2,nan"],
        ["--harmonics", "1"],
        ["--duration", "0"],
        ["--periods", "0"],
        ["--criterion", "best"],
        ["--json", "no/such/folder/x.json"],
        ["--json", ROBOT],
    ],
)
def test_wrong_usage_is_status_two(words: list[str]) -> None:
    assert main(["excite", ROBOT, *words]) == 2
