"""What the diagnosing process sees: recordings and a robot file, no word of the truth, and no way to it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from concealed.generator.arms import NOISE_STD, arm_named, without_truth
from concealed.generator.case import SERIES, drawn
from concealed.generator.concealment import Concealed
from concealed.generator.effects import CATALOGUE
from concealed.generator.sensing import Noise
from concealed.generator.trial import Trial
from concealed.sealing.sealed import Sealed, apart, nominal_constants, sealed
from concealed.sealing.truth import opened
from tauscope.recording import Recording, read_recording
from tauscope.robot import read_robot

GAIN = 1.07


@pytest.fixture
def these(tmp_path: Path) -> Sealed:
    """A trial of the series that logs currents, with a short recording in the place of a simulated one."""
    rng = np.random.default_rng(5)
    time = np.arange(50) / 200.0
    recordings = [
        Recording.from_arrays(name, time, rng.normal(size=(50, 3)), rng.normal(size=(50, 3))) for name in ("a", "b")
    ]
    case = drawn("constant", 3, "paper")
    entry = {"effect": "torque_gain_error", "joint": 2, "gain": GAIN}
    robot = without_truth(arm_named("paper"), states_friction=True)
    ground = CATALOGUE["torque_gain_error"](_Ground, rng)  # type: ignore[arg-type]
    trial = Trial(
        "paper", Concealed((ground,), (entry,), 15.0), robot, recordings, recordings, Noise(NOISE_STD["paper"])
    )
    (tmp_path / "vault").mkdir()
    return sealed(case, trial, tmp_path / "seen", tmp_path / "vault")


class _Ground:
    joint = 1


def test_currents_times_the_nominal_constant_are_the_reported_torque(these: Sealed) -> None:
    robot = read_robot(these.folder / "robot.yaml")
    constants = nominal_constants(these.case, 3)
    assert constants is not None
    assert [joint.torque_constant for joint in robot.joints] == pytest.approx(constants)
    logged = read_recording(these.folder / "train1.csv")
    assert logged.effort_kind == "i"
    torque = logged.joint_torque(logged.samples().effort, robot)
    np.testing.assert_allclose(torque, these.trial.train[0].samples().effort, rtol=1e-12)


def test_nothing_that_is_seen_says_what_is_concealed(these: Sealed) -> None:
    assert sorted(path.name for path in these.folder.iterdir()) == [
        "held-out1.csv",
        "held-out2.csv",
        "robot.yaml",
        "train1.csv",
        "train2.csv",
    ]
    for path in these.folder.iterdir():
        text = path.read_text()
        assert "gain" not in text
        assert "vault" not in text
    header, *rows = (these.folder / "train1.csv").read_text().splitlines()
    assert header == "t,q1,q2,q3,i1,i2,i3"
    assert all(len(row.split(",")) == 7 for row in rows)
    assert str(GAIN) not in (these.folder / "robot.yaml").read_text()
    assert read_robot(these.folder / "robot.yaml").model.links is None


def test_the_diagnosing_process_cannot_draw_the_truth_itself(tmp_path: Path) -> None:
    def imports(package: str) -> int:
        command = [sys.executable, "-c", f"import {package}"]
        return subprocess.run(command, cwd=tmp_path, env=apart(), capture_output=True, check=False).returncode

    assert imports("tauscope") == 0
    assert imports("concealed") == 1


def test_a_changed_truth_is_not_opened(these: Sealed) -> None:
    truth = opened(these.truth, these.seal)
    assert truth.hidden[0].parameters == {"g": pytest.approx(GAIN - 1.0)}
    told = json.loads(these.truth.read_text())
    told["hidden"][0]["labels"] = ["cogging@joint1"]
    these.truth.write_text(json.dumps(told))
    with pytest.raises(ValueError, match="not what was sealed"):
        opened(these.truth, these.seal)


@pytest.mark.parametrize("series", SERIES)
def test_reports_see_motions_that_development_never_saw(series: str) -> None:
    looked_at = {drawn(series, seed).motion_seed for seed in range(60)}
    reported = {drawn(series, 1_000_000 + seed).motion_seed for seed in range(60)}
    assert len(looked_at) == len(reported) == 4
    assert not looked_at & reported
    assert drawn(series, 17) == drawn(series, 17)
