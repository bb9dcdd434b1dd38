"""Outcomes on disk: what was kept is not tried again, and a crash costs the trial that was being written."""

import json
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pytest

from concealed.running import run as running
from concealed.running.kept import Kept
from concealed.task import Task

ONE = {"series": "sound", "seed": 1, "arm": None, "score": {"verdict": "consistent"}}
TWO = {"series": "weak", "seed": 2, "arm": "six", "error": "no effect reaches it"}


class AtOnce(Executor):
    """Does what is submitted before it returns."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def test_what_is_kept_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "outcomes.jsonl"
    first = Kept(path)
    first.add(ONE)
    first.add(TWO)
    again = Kept(path)
    assert again.outcomes == [ONE, TWO]
    assert not again.torn
    assert again.of({("weak", 2, "six")}) == [TWO]


@pytest.mark.parametrize("cut", range(1, len(json.dumps(TWO)) + 1, 9))
def test_a_torn_last_line_is_cut_off_wherever_it_tore(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "outcomes.jsonl"
    whole = json.dumps(ONE) + "\n"
    path.write_text(whole + json.dumps(TWO)[:cut])
    kept = Kept(path)
    assert kept.torn
    assert kept.outcomes == [ONE]
    kept.add(TWO)
    assert Kept(path).outcomes == [ONE, TWO]


@pytest.mark.parametrize("line", ["nonsense", '{"seed": 1}', "[1, 2]"])
def test_a_line_that_no_crash_can_have_torn_is_named(tmp_path: Path, line: str) -> None:
    path = tmp_path / "outcomes.jsonl"
    path.write_text(json.dumps(ONE) + "\n" + line + "\n" + json.dumps(TWO) + "\n")
    with pytest.raises(ValueError, match=r"outcomes\.jsonl, line 2: no outcome of a trial"):
        Kept(path)


def test_a_set_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[int] = []

    def outcome(task: Task) -> dict[str, Any]:
        tried.append(task.seed)
        return {"series": task.series, "seed": task.seed, "arm": task.arm}

    monkeypatch.setattr(running, "outcome", outcome)
    tasks = [Task("sound", seed) for seed in range(4)]
    kept = Kept(tmp_path / "outcomes.jsonl")
    running.run(tasks[:2], kept, AtOnce(), lambda each: None)
    told: list[int] = []
    left = running.run(tasks, Kept(kept.path), AtOnce(), lambda each: told.append(each["seed"]))
    assert tried == [0, 1, 2, 3]
    assert sorted(told) == [2, 3]
    assert left == 0
    assert len(Kept(kept.path).outcomes) == 4


def test_what_would_begin_too_late_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Though the executor was given all of it at once."""
    clock = [100.0]

    def outcome(task: Task) -> dict[str, Any]:
        clock[0] += 60.0
        return {"series": task.series, "seed": task.seed, "arm": task.arm}

    monkeypatch.setattr(running, "outcome", outcome)
    monkeypatch.setattr(running.time, "time", lambda: clock[0])
    kept = Kept(tmp_path / "outcomes.jsonl")
    tasks = [Task("sound", seed) for seed in range(5)]
    left = running.run(tasks, kept, AtOnce(), lambda each: None, until=150.0)
    assert sorted(each["seed"] for each in kept.outcomes) == [0, 1, 2]
    assert left == 2
