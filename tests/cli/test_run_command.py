"""``tauscope run``: a recording, or one line that says why there is none; nothing is ever replaced."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cli.conftest import Ended
from server.queue.paper_files import PAPER_ROBOT
from server.queue.waiting import wait_until
from shared_data import REPOSITORY
from tauscope.cli.run_command import explain_unfinished
from tauscope.recording import read_recording
from tauscope.runtime.record import RunProblem, new_record
from tauscope.runtime.states import RunState
from tauscope.trajectory import Trajectory, write_trajectory
from tauscope.trajectory.segments import MoveSegment

Run = Callable[..., Ended]


def motion(path: Path, duration_s: float) -> Path:
    """A slow move of the paper's arm."""
    move = MoveSegment(np.array([0.0, 0.6, 0.6]), np.array([0.5, 1.0, 0.0]), duration_s)
    write_trajectory(Trajectory("paper-arm", ("joint1", "joint2", "joint3"), (move,)), path)
    return path


START = "--start=0,0.6,0.6"


@pytest.fixture
def short(tmp_path: Path) -> Path:
    return motion(tmp_path / "short.json", 1.0)


@pytest.mark.parametrize(
    "suffix", [".csv", *(pytest.param(each, marks=pytest.mark.slow) for each in (".parquet", ".mcap"))]
)
def test_a_recording_in_every_format(suffix: str, run: Run, short: Path, tmp_path: Path) -> None:
    out = tmp_path / f"out{suffix}"
    ended = run("run", PAPER_ROBOT, "--trajectory", short, "--out", out, "--rate", "200", START)
    assert (ended.status, ended.err) == (0, "")
    assert f"wrote {out}\n" in ended.out
    recording = read_recording(out)
    assert recording.joint_count == 3
    assert len(recording) >= 195
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["short.json", out.name])


@pytest.mark.slow
def test_a_link_that_no_body_can_be_is_simulated_as_the_nearest_body(run: Run, short: Path, tmp_path: Path) -> None:
    robot = tmp_path / "robot.yaml"
    text = Path(PAPER_ROBOT).read_text(encoding="utf-8")
    robot.write_text(text.replace("{xx: 0, yy: 0.117", "{xx: 1, yy: 0.117", 1), encoding="utf-8")
    ended = run("run", robot, "--trajectory", short, "--out", tmp_path / "out.csv", "--rate", "200", START)
    assert (ended.status, ended.err) == (0, "")
    warning = next(line for line in ended.out.splitlines() if line.startswith("! "))
    assert "inertia breaks the triangle inequality" in warning
    assert "the nearest body is used" in warning


def test_scenario_posture_and_limits_of_lost_samples_count_and_a_name_is_made_of_the_moment(
    run: Run, short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenario.yaml").write_text("torque_noise_std: 2.0\n", encoding="utf-8")
    lenient = ["--stale-ms", "5", "--missed", "10", "--lost-s", "0.2", "--least-kept", "0.5"]
    options = ["--scenario", "scenario.yaml", "--start", "0.2,0.6,0.6", *lenient]
    ended = run("run", PAPER_ROBOT, "--trajectory", short, "--rate", "200", *options)
    assert ended.status == 0
    assert "samples kept" in ended.out
    (made,) = tmp_path.glob("run-*Z.csv")
    assert f"wrote {made.name}\n" in ended.out
    # Differences of white noise have √2 times its deviation; without noise the torque of this motion has less than 0.1.
    assert np.diff(read_recording(made).samples().effort, axis=0).std() == pytest.approx(2.0 * np.sqrt(2.0), rel=0.2)


def test_a_file_that_is_there_stays(run: Run, short: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text("mine")
    ended = run("run", PAPER_ROBOT, "--trajectory", short, "--out", tmp_path / "mine.csv")
    assert (ended.status, len(ended.err.splitlines())) == (1, 1)
    assert "is not replaced" in ended.err
    assert (tmp_path / "mine.csv").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.csv", "short.json"]


@pytest.mark.parametrize(
    ("options", "status", "words"),
    [
        (["--out", "out.txt"], 2, "the suffix names no format"),
        (["--out", "gone/out.csv"], 2, "does not exist"),
        (["--start", "a,b"], 2, "is not numbers separated by commas"),
        (["--start", "nan,0,0"], 2, "is not numbers separated by commas"),
        (["--backend", "real"], 2, "--backend"),
        (["--mode", "speed"], 2, "--mode"),
        (["--rate", "0"], 2, "--rate"),
        (["--backend", "canopen", "--time", "real"], 2, "--time belongs to --backend sim"),
        (["--start", "0,0"], 1, "start has to be 3 numbers"),
        (["--backend", "dynamixel"], 1, "no drive block"),
        (["--backend", "canopen"], 1, "no drive block"),
        (["--trajectory", PAPER_ROBOT], 1, "paper_arm.yaml"),
        (["--scenario", PAPER_ROBOT], 1, "paper_arm.yaml"),
    ],
)
def test_what_is_refused(
    options: list[str | Path], status: int, words: str, run: Run, short: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    trajectory = [] if "--trajectory" in options else ["--trajectory", short]
    ended = run("run", PAPER_ROBOT, *trajectory, *options)
    assert ended.status == status, ended
    assert words in ended.err
    assert "Traceback" not in ended.err
    if status == 1:
        assert len(ended.err.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["short.json"]


@pytest.mark.slow
def test_ctrl_c_stops_the_arm_and_keeps_what_was_recorded(tmp_path: Path) -> None:
    long = motion(tmp_path / "long.json", 600.0)
    out = tmp_path / "out.csv"
    command = [sys.executable, "-m", "tauscope.cli", "run", PAPER_ROBOT, "--trajectory", long, "--out", out]
    with subprocess.Popen(
        [str(word) for word in [*command, "--rate", "200", START]],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:

        def is_running() -> bool:
            records = list(tmp_path.glob(".tauscope-run-*/run/run.json"))
            if not records or json.loads(records[0].read_bytes())["state"] != "running":
                return False
            return records[0].with_name("journal.mcap").stat().st_size > 200_000

        wait_until(is_running)
        os.kill(process.pid, signal.SIGINT)
        printed, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert len(err.splitlines()) == 1
    assert "the run stopped" in err
    assert str(out) in err
    assert f"wrote {out}\n" in printed
    assert len(read_recording(out)) > 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["long.json", "out.csv"]


@pytest.mark.parametrize(
    ("holds", "words"),
    [
        (True, "the disk is full; the arm was stopped and holds; its journal is /runs/journal.mcap; free disk space"),
        (False, "the disk is full; the arm was stopped and is without power; its journal is"),
        (
            None,
            "the disk is full; nobody has confirmed its stop, so its drives stop by themselves: look at the arm; its",
        ),
    ],
)
def test_a_failed_run_says_what_the_arm_does_and_where_the_journal_is(holds: bool | None, words: str) -> None:
    record = new_record("arm", "canopen", "position").model_copy(
        update={
            "state": RunState.FAILED,
            "played": 0.5,
            "holds": holds,
            "problem": RunProblem(code="acquisition", detail="the disk is full"),
        }
    )
    assert words in explain_unfinished(record, None, Path("/runs/journal.mcap"))
