"""Columns of other tools at every verb: options, the robot file, the library, and the wizard."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tauscope
from cli.conftest import Ended
from cli.simulated_files import SimulatedFiles
from tauscope.recording.layout.guess import flow_text
from tauscope.tasks.identify import IdentificationOptions, Request

Run = Callable[..., Ended]
COLUMNS = {"t": "clock", "q": "pos_{0}", "tau": ["m_a", "m_b", "m_c"]}


@pytest.fixture
def foreign(files: SimulatedFiles, tmp_path: Path) -> Path:
    """The first recording with other names, in degrees, with decimal commas."""
    header, *lines = files.train[0].read_text(encoding="utf-8").splitlines()
    rows = np.array([[float(field) for field in line.split(",")] for line in lines])[:, :7]
    assert header.startswith("t,q1,q2,q3,tau1,tau2,tau3")
    rows[:, 1:4] *= 180.0 / np.pi
    text = ["clock;pos_0;pos_1;pos_2;m_a;m_b;m_c"]
    text += [";".join(repr(value).replace(".", ",") for value in row) for row in rows.tolist()]
    path = tmp_path / "foreign.csv"
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def mapping(tmp_path: Path) -> Path:
    path = tmp_path / "map.yaml"
    path.write_text(f"recording: {{columns: {flow_text(COLUMNS)}, units: {{q: deg}}}}\n", encoding="utf-8")
    return path


def test_every_verb_takes_a_mapping(
    run: Run, files: SimulatedFiles, foreign: Path, mapping: Path, tmp_path: Path
) -> None:
    refused = run("identify", files.robot, foreign)
    assert refused.status == 1
    (line,) = refused.err.splitlines()
    assert "give --columns FILE.yaml with a name for each ?" in line
    errors = []
    for words in (("--columns", mapping), ("--columns", flow_text(COLUMNS), "--units", "q=deg")):
        ended = run("identify", files.robot, foreign, *words, "--json", "-")
        assert ended.status == 0, ended.err
        errors.append(json.loads(ended.out)["fit"]["train"]["relative_error"])
    assert errors[0] == errors[1] < 0.02
    assert run("recording", "check", foreign, "--columns", mapping, "--robot", files.robot).status == 0
    converted = tmp_path / "converted.csv"
    ended = run("recording", "convert", foreign, converted, "--columns", mapping, "--decimal", ",", "--delimiter", ";")
    assert ended.status == 0
    sound = tauscope.read_recording(files.train[0], files.robot).samples()
    assert np.allclose(tauscope.read_recording(converted, files.robot).samples().position, sound.position)


def test_the_robot_file_and_the_library_take_a_mapping(
    files: SimulatedFiles, foreign: Path, mapping: Path, tmp_path: Path
) -> None:
    robot = tmp_path / "robot.yaml"
    text = files.robot.read_text(encoding="utf-8")
    robot.write_text(f"{text}\nrecording: {{columns: {flow_text(COLUMNS)}, units: {{q: deg}}}}\n", encoding="utf-8")
    sound = tauscope.read_recording(files.train[0], files.robot).samples()
    for recording in (
        tauscope.read_recording(foreign, robot),
        tauscope.read_recording(files.train[0], robot),  # its own columns: not as the robot file says
        tauscope.read_recording(foreign, files.robot, columns=mapping),
        tauscope.read_recording(foreign, files.robot, columns=COLUMNS, units={"q": "deg"}, decimal=",", delimiter=";"),
    ):
        assert np.allclose(recording.samples().position, sound.position)
        assert np.array_equal(recording.samples().effort, sound.effort)


def test_the_wizard_writes_what_columns_takes(
    run: Run, files: SimulatedFiles, foreign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from io import StringIO

    answers = "\npos_{0}\nm_a, m_b, m_c\n-\n-\n"
    monkeypatch.setattr("sys.stdin", StringIO(answers))
    out = tmp_path / "asked.yaml"
    ended = run("recording", "map", foreign, "--robot", files.robot, "--ask", "--out", out)
    assert ended.status == 0, ended.err
    assert "3 joints" in ended.out
    assert run("recording", "check", foreign, "--columns", out, "--units", "q=deg").status == 0
    wrong = run("recording", "map", foreign, "--robot", files.robot, "--no-ask")
    assert wrong.status == 1
    assert "column tau1 (or i1, torque or current of joint 1) is missing" in wrong.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--columns", "rdte"), "neither a preset (rtde, libfranka"),
        (("--columns", "{x: a}"), "'x' is no column of a recording"),
        (("--decimal", "'"), "is no decimal sign"),
        (("--delimiter", "x"), "separates no fields"),
    ],
)
def test_a_layout_that_is_none_is_wrong_usage(
    run: Run, files: SimulatedFiles, words: tuple[str, ...], said: str
) -> None:
    ended = run("identify", files.robot, files.train[0], *words)
    assert ended.status == 2
    assert said in " ".join(ended.err.split())


def test_the_command_of_a_result_holds_the_mapping() -> None:
    options = IdentificationOptions(columns=COLUMNS, decimal=",", delimiter="semicolon", topic="/a")
    words = Request(robot="r.yaml", recordings=("a.csv",), options=options).command
    assert words[words.index("--columns") + 1] == '{t: clock, q: "pos_{0}", tau: [m_a, m_b, m_c]}'
    assert words[words.index("--topic") + 1] == "/a"
