"""Faults at random, a hundred of the ten thousand: `TAUSCOPE_INJECTIONS=10000 pytest tests/reliability` for all."""

import os
import subprocess
import sys

import pytest

from shared_data import REPOSITORY

INJECTIONS = int(os.environ.get("TAUSCOPE_INJECTIONS", "100"))
SEED = os.environ.get("TAUSCOPE_SEED", "1")


@pytest.mark.slow
@pytest.mark.timeout(0 if INJECTIONS > 100 else 1200)
def test_no_lost_recording_no_stuck_job_no_wrong_status() -> None:
    """In a process of its own, which forks, and has as little in it as possible."""
    words = [sys.executable, "-m", "reliability.campaign", "--injections", str(INJECTIONS), "--seed", SEED]
    path = os.pathsep.join((str(REPOSITORY), str(REPOSITORY / "tests")))
    ended = subprocess.run(words, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr[-20_000:]
    assert "nothing broken" in ended.stdout
    if INJECTIONS > 100:
        print(ended.stdout)
