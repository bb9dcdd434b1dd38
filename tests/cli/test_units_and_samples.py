"""Units, trust and warnings at every verb, and in the library."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tauscope
from cli.conftest import Ended
from cli.simulated_files import SimulatedFiles
from tauscope.errors import RecordingError

Run = Callable[..., Ended]


def rewritten(path: Path, target: Path, change: Callable[[list[str], np.ndarray], None]) -> Path:
    """A recording with other columns: t, q1…q3, tau1…tau3, period."""
    header, *lines = path.read_text(encoding="utf-8").splitlines()
    names, rows = header.split(","), np.array([[float(field) for field in line.split(",")] for line in lines])
    change(names, rows)
    text = [",".join(names), *(",".join(map(repr, row)) for row in rows.tolist())]
    target.write_text("\n".join(text) + "\n", encoding="utf-8")
    return target


@pytest.fixture
def odd(files: SimulatedFiles, tmp_path: Path) -> Path:
    """Milliseconds and degrees."""

    def change(names: list[str], rows: np.ndarray) -> None:
        rows[:, 0] *= 1e3
        rows[:, [names.index(f"q{joint}") for joint in (1, 2, 3)]] *= 180.0 / np.pi

    return rewritten(files.train[0], tmp_path / "odd.csv", change)


def error_of(ended: Ended) -> float:
    assert ended.status == 0
    return json.loads(ended.out)["fit"]["train"]["relative_error"]


def test_a_recording_in_other_units_is_refused_and_read(run: Run, files: SimulatedFiles, odd: Path) -> None:
    for words in (("identify", files.robot, odd), ("diagnose", files.robot, odd), ("recording", "check", odd)):
        ended = run(*words)
        assert ended.status == 1
        (line,) = ended.err.splitlines()
        assert line.startswith(f"{odd}: column t: ")
        assert "--units t=ms" in line
    half = run("identify", files.robot, odd, "--units", "t=ms")
    assert half.status == 1
    assert "--units q=deg" in half.err
    sound = error_of(run("identify", files.robot, files.train[0], "--json", "-"))
    mended = error_of(run("identify", files.robot, odd, "--units", "t=ms,q=deg", "--json", "-"))
    assert mended == pytest.approx(sound, rel=1e-6)
    assert run("recording", "check", odd, "--units", "t=ms,q=deg", "--robot", files.robot).status == 0


def test_the_robot_file_states_units(run: Run, files: SimulatedFiles, odd: Path, tmp_path: Path) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text(
        files.robot.read_text(encoding="utf-8") + "\nrecording: {units: {t: ms, q: deg}}\n", encoding="utf-8"
    )
    sound = error_of(run("identify", files.robot, files.train[0], "--json", "-"))
    assert error_of(run("identify", robot, odd, "--json", "-")) == pytest.approx(sound, rel=1e-6)
    assert error_of(run("identify", robot, files.train[0], "--units", "t=s,q=rad", "--json", "-")) == pytest.approx(
        sound
    )


def test_trust_goes_on_with_a_warning(run: Run, files: SimulatedFiles, odd: Path) -> None:
    ended = run("recording", "check", odd, "--trust-units")
    assert ended.status == 0
    assert "warning: t: rows are 10 s apart" in ended.out
    recording = tauscope.read_recording(odd, files.robot, trust_units=True)
    assert recording.warnings[0].code == "doubtful-units"


def test_the_library_takes_units(files: SimulatedFiles, odd: Path) -> None:
    with pytest.raises(RecordingError, match="--units t=ms"):
        tauscope.read_recording(odd, files.robot)
    recording = tauscope.read_recording(odd, files.robot, units={"t": "ms", "q": "deg"})
    sound = tauscope.read_recording(files.train[0], files.robot)
    np.testing.assert_allclose(recording.samples().position, sound.samples().position, atol=1e-12)
    np.testing.assert_allclose(recording.samples().time, sound.samples().time, atol=1e-12)


def test_a_sample_index_has_a_rate(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    def count(names: list[str], rows: np.ndarray) -> None:
        rows[:, 0] = np.arange(len(rows))

    path = rewritten(files.train[0], tmp_path / "counted.csv", count)
    sound = error_of(run("identify", files.robot, files.train[0], "--json", "-"))
    counted = run("identify", files.robot, path, "--units", "t=index", "--rate", "100", "--json", "-")
    assert error_of(counted) == pytest.approx(sound, rel=1e-6)
    ended = run("identify", files.robot, path, "--units", "t=index")
    assert ended.status == 1
    assert "state their rate" in ended.err


@pytest.mark.parametrize("words", ["t=h", "t", "q=deg,q=rad", "speed=rpm"])
def test_units_that_are_none_are_wrong_usage(run: Run, files: SimulatedFiles, words: str) -> None:
    ended = run("identify", files.robot, files.train[0], "--units", words)
    assert ended.status == 2
    assert "--units" in ended.err


def test_currents_need_a_torque_constant(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    def current(names: list[str], rows: np.ndarray) -> None:
        rows[:, [names.index(f"tau{joint}") for joint in (1, 2, 3)]] *= 500.0

    path = rewritten(files.train[0], tmp_path / "current.csv", current)
    ended = run("identify", files.robot, path, "--units", "tau=mA")
    assert ended.status == 1
    assert "states no torque_constant for joint 1 (joint1); state joints[0].torque_constant" in ended.err
    robot = tmp_path / "robot.yaml"
    text = files.robot.read_text(encoding="utf-8").replace("- name: joint", "- torque_constant: 2.0\n  name: joint")
    robot.write_text(text, encoding="utf-8")
    sound = error_of(run("identify", files.robot, files.train[0], "--json", "-"))
    mended = error_of(run("identify", robot, path, "--units", "tau=mA", "--json", "-"))
    assert mended == pytest.approx(sound, rel=1e-6)


def test_masked_samples_are_warned_of(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    def drop(names: list[str], rows: np.ndarray) -> None:
        rows[100:130, [names.index(f"tau{joint}") for joint in (1, 2, 3)]] = 0.0

    path = rewritten(files.train[0], tmp_path / "dropped.csv", drop)
    ended = run("identify", files.robot, path, "--json", "-")
    assert ended.status == 0
    assert f"warning: {path}: columns tau1, tau2, tau3: 30 rows of exactly zero" in ended.err
    assert "(effort-dropouts)" in ended.err
    assert json.loads(ended.out)["conditioning"][0]["missed_torques"] == [30, 30, 30]
    assert "warning: tau1, tau2, tau3: 30 rows of exactly zero" in run("recording", "check", path).out
