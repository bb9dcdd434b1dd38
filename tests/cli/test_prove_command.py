"""``tauscope prove``."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from cli.conftest import Ended
from tauscope.cli.prove_command import become_trials
from tauscope.errors import NotFoundError

Run = Callable[..., Ended]


def test_without_the_trials_one_line_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"tests/concealed.*not installed.*clone the repository"):
        become_trials(tmp_path, [])


def test_the_trials_run_in_its_place_and_are_found(tmp_path: Path) -> None:
    """A clone with another program in the trials' place, which says how it was called."""
    trials = tmp_path / "tests" / "concealed"
    trials.mkdir(parents=True)
    (trials / "proof.py").write_text(
        "import json, os, sys\n"
        "print(json.dumps([sys.argv[1:], os.environ['PYTHONPATH'], os.getpid()]))\n"
        "raise SystemExit(3)\n"
    )
    call = (
        f"from tauscope.cli.prove_command import *; become_trials(Path({str(tmp_path)!r}), ['--full', '--jobs', '2'])"
    )
    with subprocess.Popen([sys.executable, "-c", call], stdout=subprocess.PIPE, text=True) as process:
        told, _ = process.communicate()
    assert process.returncode == 3
    words, path, pid = json.loads(told)
    assert words == ["--full", "--jobs", "2"]
    assert pid == process.pid, "a signal reaches the trials themselves"
    assert path.split(os.pathsep)[:2] == [str(tmp_path), str(tmp_path / "tests")]


def test_its_options_reach_the_trials(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    called: list[list[str]] = []

    monkeypatch.setattr("tauscope.cli.prove_command.become_trials", lambda repository, words: called.append(words))
    words = ["--full", "--scheduler", "tcp://one:8786", "--page", str(tmp_path / "p.md")]
    assert run("prove", "--first-seed", "7", "--out", tmp_path, *words).status == 0
    assert called == [["--out", str(tmp_path), "--first-seed", "7", *words]]
