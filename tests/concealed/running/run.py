"""Many trials: those that are not there yet, by whatever workers there are, kept as they end."""

import subprocess
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from pathlib import Path

from concealed.running.kept import Kept, Outcome
from concealed.running.time_limit import TimeIsUp, time_limit
from concealed.task import Task, outcome

REPOSITORY = Path(__file__).resolve().parents[3]
JUDGED = ("service", "sim_backend", "drivers", "tests/concealed")
"""What an outcome depends on."""

PATIENCE_S = 120.0
"""How long after the last instant to begin at trials are given up: a few take minutes to be simulated at all."""


def run(
    tasks: Sequence[Task],
    kept: Kept,
    executor: Executor,
    told: Callable[[Outcome], None],
    *,
    until: float | None = None,
) -> int:
    """Try what is not kept yet, in the order given; the number of trials left over after `until` [s].

    With a time limit, trials that have not begun by then are not begun, though workers may have been given them, and
    those that have not ended `PATIENCE_S` later are given up.
    """
    end = None if until is None else time.time() + until
    there = {(each["series"], each["seed"], each["arm"]) for each in kept.outcomes}
    futures = {executor.submit(in_time, task, end): task for task in tasks if task.key not in there}
    left = len(futures)
    for future in as_completed(futures):
        found = future.result()
        if found is not None:
            kept.add(found)
            told(found)
            left -= 1
    return left


def in_time(task: Task, end: float | None) -> Outcome | None:
    """A trial's outcome; None where it would begin after an instant of the wall clock [s], or end long after it."""
    if end is None:
        return outcome(task)
    if time.time() >= end:
        return None
    try:
        with time_limit(end + PATIENCE_S - time.time()):
            return outcome(task)
    except TimeIsUp:
        return None


def commit() -> str:
    """The commit that is tried, with ``+`` where files have been changed since; empty where git says nothing."""

    def git(*words: str) -> str:
        told = subprocess.run(["git", *words], cwd=REPOSITORY, capture_output=True, text=True, check=False)
        return told.stdout.strip() if told.returncode == 0 else ""

    changed = git("status", "--porcelain", "--untracked-files=no", "--", *JUDGED)
    return git("rev-parse", "--short=10", "HEAD") + ("+" if changed else "")
