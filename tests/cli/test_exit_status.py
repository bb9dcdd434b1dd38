"""0 done, 1 the data or the robot cannot answer, 2 wrong usage; and what is said then."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import tauscope.tasks.identify
from cli.conftest import Ended
from cli.simulated_files import SimulatedFiles
from tauscope.cli import main
from tauscope.cli.program import ExitStatus

Run = Callable[..., Ended]
PROGRAM = [sys.executable, "-m", "tauscope.cli"]


WRONG_USAGE = {
    "no verb": [],
    "unknown verb": ["identfy"],
    "no robot": ["identify"],
    "no recording": ["identify", "ROBOT"],
    "all recordings held out": ["identify", "ROBOT", "--held-out", "TRAIN"],
    "missing robot": ["identify", "gone.yaml", "TRAIN"],
    "missing recording": ["identify", "ROBOT", "gone.csv"],
    "missing held-out": ["identify", "ROBOT", "TRAIN", "--held-out", "HELD", "gone.csv"],
    "unknown option": ["identify", "ROBOT", "TRAIN", "--estimate", "ls"],
    "unknown estimator": ["identify", "ROBOT", "TRAIN", "--estimator", "ridge"],
    "no such cut-off": ["identify", "ROBOT", "TRAIN", "--cutoff", "-1"],
    "held out and not": ["identify", "ROBOT", "TRAIN", "--held-out", "TRAIN"],
    "twice": ["identify", "ROBOT", "TRAIN", "TRAIN"],
    "output into nowhere": ["identify", "ROBOT", "TRAIN", "--json", "gone/out.json"],
    "output is an input": ["identify", "ROBOT", "TRAIN", "--json", "TRAIN"],
    "output twice": ["identify", "ROBOT", "TRAIN", "--json", "x.out", "--report", "x.out"],
    "no such export": ["identify", "ROBOT", "TRAIN", "--export", "model.step"],
    "export is an input": ["identify", "ROBOT", "TRAIN", "--export", "ROBOT"],
    "robot is a folder": ["robot", "check", "FOLDER"],
    "no verb of robot": ["robot"],
    "no joints": ["recording", "check", "TRAIN", "--joints", "0"],
    "unknown format": ["recording", "convert", "TRAIN", "out.xls"],
    "no such port": ["serve", "--port", "65536"],
}

CANNOT_ANSWER = {
    "robot is not YAML": ["identify", "NOISE", "TRAIN"],
    "recording is no recording": ["identify", "ROBOT", "NOISE"],
    "robot file is a recording": ["robot", "check", "TRAIN"],
    "other number of joints": ["recording", "check", "TRAIN", "--joints", "6"],
    "empty": ["recording", "check", "EMPTY"],
    "folder without recording": ["recording", "check", "FOLDER"],
    "too short": ["identify", "ROBOT", "SHORT"],
    "target exists": ["recording", "convert", "TRAIN", "EXISTING"],
    "target is the source": ["recording", "convert", "TRAIN", "TRAIN", "--overwrite"],
    "open to others": ["serve", "--host", "192.0.2.1"],
}


@pytest.fixture
def places(files: SimulatedFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Files by the names of the tables above; the current folder is empty."""
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    noise, empty, short = tmp_path / "noise", tmp_path / "empty.csv", tmp_path / "short.csv"
    noise.write_bytes(bytes(range(256)) * 8)
    empty.write_bytes(b"")
    short.write_text("".join(files.train[0].read_text(encoding="utf-8").splitlines(keepends=True)[:12]))
    existing = tmp_path / "existing.csv"
    existing.write_text("mine")
    (tmp_path / "folder").mkdir()
    return {
        "ROBOT": str(files.robot),
        "TRAIN": str(files.train[0]),
        "HELD": str(files.held_out[0]),
        "NOISE": str(noise),
        "EMPTY": str(empty),
        "SHORT": str(short),
        "EXISTING": str(existing),
        "FOLDER": str(tmp_path / "folder"),
    }


@pytest.mark.parametrize("case", WRONG_USAGE)
def test_wrong_usage_is_2(run: Run, places: dict[str, str], case: str) -> None:
    ended = run(*(places.get(word, word) for word in WRONG_USAGE[case]))
    assert ended.status == 2
    assert "Traceback" not in ended.err
    assert "this is a bug" not in ended.err
    assert ended.err.strip() or ended.out.strip()
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize("case", CANNOT_ANSWER)
def test_no_answer_is_1_and_one_line(run: Run, places: dict[str, str], case: str) -> None:
    ended = run(*(places.get(word, word) for word in CANNOT_ANSWER[case]))
    assert ended.status == 1
    assert len(ended.err.splitlines()) == 1
    assert "Traceback" not in ended.err
    assert "this is a bug" not in ended.err
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ["--help"],
        ["--version"],
        *([verb, "--help"] for verb in ("identify", "run", "robot", "recording", "serve", "demo")),
    ],
)
def test_help_and_version_are_0(run: Run, words: list[str]) -> None:
    ended = run(*words)
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.strip()
    assert "Parameters" not in ended.out


def test_help_says_how_held_out_is_written(run: Run) -> None:
    assert "--held-out RECORDING..." in run("identify", "--help").out


def test_a_bug_is_one_line_and_1(run: Run, files: SimulatedFiles, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise KeyError("two\nlines")

    monkeypatch.setattr(tauscope.tasks.identify, "identify", fail)
    ended = run("identify", files.robot, files.train[0])
    assert ended.status == 1
    assert len(ended.err.splitlines()) == 1
    assert "this is a bug" in ended.err
    assert "KeyError" in ended.err


def test_debugging_shows_where(run: Run, places: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TAUSCOPE_DEBUG", "1")
    ended = run("recording", "check", places["EMPTY"])
    assert ended.status == 1
    assert "Traceback" in ended.err


def test_interruption_is_130(files: SimulatedFiles, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(tauscope.tasks.identify, "identify", interrupt)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a server tested earlier may have taken it
    try:
        status = main(["identify", str(files.robot), str(files.train[0])])
    finally:
        signal.signal(signal.SIGINT, before)
    assert status == ExitStatus.INTERRUPTED == 130


def test_the_process_ends_as_main_says(files: SimulatedFiles, tmp_path: Path) -> None:
    empty = tmp_path / "empty.csv"
    empty.touch()
    for words, status in ((["--version"], 0), (["robot", "check", empty], 1), (["identfy"], 2)):
        ended = subprocess.run([*PROGRAM, *map(str, words)], check=False, capture_output=True, text=True, timeout=60)
        assert ended.returncode == status
        assert "Traceback" not in ended.stderr
        assert ("empty.csv" in ended.stderr) == (status == 1)


@pytest.mark.slow
def test_a_terminal_that_knows_ascii_only_is_no_bug(files: SimulatedFiles) -> None:
    ascii_only = os.environ | {"PYTHONIOENCODING": "ascii"}
    command = [*PROGRAM, "recording", "check", str(files.train[0])]
    ended = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60, env=ascii_only)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "\\u2026" in ended.stdout


@pytest.mark.slow
def test_a_reader_that_goes_away_is_no_bug(files: SimulatedFiles) -> None:
    command = [*PROGRAM, "robot", "check", str(files.robot)]
    reading, writing = os.pipe()
    os.close(reading)
    ended = subprocess.run(command, check=False, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(writing)
    assert "bug" not in ended.stderr
    assert "Traceback" not in ended.stderr


def test_help_loads_nothing_that_computes() -> None:
    slow = {"numpy", "matplotlib", "rich.table", "mujoco", "fastapi"}
    code = f"import sys; from tauscope.cli import main; main(['--help']); print(sorted(set(sys.modules) & {slow}))"
    ended = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)
    assert ended.stdout.splitlines()[-1] == "[]"


def test_a_file_name_of_broken_unicode_is_no_bug(run: Run, files: SimulatedFiles, tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"bad-\xff-name.csv")
    path.write_bytes(files.train[0].read_bytes())
    out, page = tmp_path / "out.json", tmp_path / "report.html"
    ended = run("identify", files.robot, path, "--json", out, "--report", page)
    assert ended.status == 0, ended.err
    assert out.is_file()
    assert page.is_file()
