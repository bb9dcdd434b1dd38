"""``tauscope prove``."""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from cli.conftest import Ended
from service.cli.prove_command import tried
from service.errors import NotFoundError

Run = Callable[..., Ended]


def test_without_the_trials_one_line_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"tests/concealed.*not installed.*clone the repository"):
        tried(tmp_path, [])


def test_the_trials_run_in_a_process_that_finds_them(tmp_path: Path) -> None:
    """A clone with another program in the trials' place, which says how it was called."""
    trials = tmp_path / "tests" / "concealed"
    trials.mkdir(parents=True)
    (trials / "proof.py").write_text(
        "import json, os, sys\n"
        f"open({str(tmp_path / 'told.json')!r}, 'w').write(json.dumps([sys.argv[1:], os.environ['PYTHONPATH']]))\n"
        "raise SystemExit(3)\n"
    )
    assert tried(tmp_path, ["--full", "--jobs", "2"]) == 3
    words, path = json.loads((tmp_path / "told.json").read_text())
    assert words == ["--full", "--jobs", "2"]
    assert path.split(os.pathsep)[:2] == [str(tmp_path), str(tmp_path / "tests")]


def test_its_options_reach_the_trials(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    called: list[list[str]] = []

    def status(repository: Path, words: list[str]) -> int:
        called.append(words)
        return 0

    monkeypatch.setattr("service.cli.prove_command.tried", status)
    assert run("prove", "--full", "--first-seed", "7", "--out", tmp_path, "--page", tmp_path / "p.md").status == 0
    assert called == [["--out", str(tmp_path), "--first-seed", "7", "--full", "--page", str(tmp_path / "p.md")]]
