"""Rollouts of real machines whose loop is known: one axis with its published gains, a servo by its register gain."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tauscope
from shared_data import SHARED_DATA, needs_shared_data
from tauscope.cli import main
from tauscope.recording import EffortKind, Recording
from tauscope.robot import Actuator, Robot

pytestmark = needs_shared_data


def _with_loop(folder: Path, loop: Actuator) -> Robot:
    robot = tauscope.load_robot(folder / "robot.yaml")
    return replace(robot, joints=(replace(robot.joints[0], actuator=loop),))


def _model(folder: Path, path: Path) -> Path:
    train = sorted(map(str, folder.glob("train*.csv")))
    assert main(["identify", str(folder / "robot.yaml"), *train, "--model", str(path)]) == 0
    return path


@pytest.mark.slow
def test_emps_under_its_own_controller(tmp_path: Path) -> None:
    """kp = 160.18 1/s and kv = 243.45 V/(m/s), times 35.15 N/V (Janot et al. 2019)."""
    folder = SHARED_DATA / "emps"
    damping = 243.45 * 35.1507
    robot = _with_loop(folder, Actuator("position", 160.18 * damping, damping))
    result = tauscope.rollout(robot, sorted(folder.glob("held-out*.csv")), model=_model(folder, tmp_path / "m.json"))
    assert result.document.drive == "loop"
    assert result.document.summary[-1].rms[0] < 4e-6


def _commands(folder: Path, robot: Robot, kind: str) -> list[Recording]:
    """Recordings of a kind with their commands in place of volts, and the gain that their first line states."""
    recordings = []
    for path in sorted(folder.glob(f"{kind}*.csv")):
        samples = tauscope.read_recording(path, robot).samples()
        found = re.search(r"P gain (\d+)", path.read_text(encoding="utf-8"))
        assert found is not None
        assert samples.reference is not None
        recordings.append(
            Recording.from_arrays(
                path.name,
                samples.time,
                samples.position,
                samples.reference,
                effort_kind=EffortKind.COMMAND,
                gain=np.full_like(samples.position, float(found[1])),
                temperature=samples.temperature,
            )
        )
    return recordings


@pytest.mark.slow
def test_xl330_at_gains_that_training_had_not(tmp_path: Path) -> None:
    """Trained at register gains 100 and 400, judged at 200 and 800; 101 mrad with the makers' parameters."""
    folder = SHARED_DATA / "bam-xl330"
    loop = Actuator("position", 0, unit="register", servo="dynamixel-xl330", supply_voltage=7.2, torque_per_volt=0.0873)
    robot = _with_loop(folder, loop)
    recordings = _commands(folder, robot, "held-out")
    result = tauscope.rollout(robot, recordings, model=_model(folder, tmp_path / "m.json"))
    document = result.document
    assert document.delay[0] == pytest.approx(0.003, abs=0.004)
    assert document.summary[-1].rms[0] < 0.101
    by_horizon = {entry.horizon_s: entry.rms[0] for entry in document.recordings[0].models[-1].horizons}
    assert by_horizon[0.1] < by_horizon[1.0] < 1.1 * by_horizon[None]


@pytest.mark.slow
def test_a_refinement_on_xl330_wins_at_gains_that_training_had_not(tmp_path: Path) -> None:
    """62.9 mrad with the best form of its makers, refitted by rollouts; 50 are wanted."""
    folder = SHARED_DATA / "bam-xl330"
    loop = Actuator("position", 0, unit="register", servo="dynamixel-xl330", supply_voltage=7.2, torque_per_volt=0.0873)
    robot = _with_loop(folder, loop)
    train, judge = (_commands(folder, robot, kind) for kind in ("train", "held-out"))
    result = tauscope.rollout(robot, judge, model=_model(folder, tmp_path / "m.json"), refine=train)
    summary = {entry.model: entry.rms[0] for entry in result.document.summary}
    assert summary["refined"] < 0.050 < summary["identified"]
    refinement = result.document.refinement
    assert refinement is not None
    assert refinement.is_better
    added = {each.name: each for each in refinement.parameters if each.p_value is not None}
    assert set(added) == {"driving friction servo", "braking friction servo"}
    assert all(each.p_value < 1e-3 for each in added.values() if each.p_value is not None)
    (loss,) = (each for each in refinement.parameters if each.name == "loss of torque per volt")
    assert loss.unit == "1/K"
    assert loss.value > 3.0 * loss.std
