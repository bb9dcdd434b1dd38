"""Worker processes: one dies, the pool goes on; the service goes, they go too."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from shared_data import REPOSITORY
from tauscope.server.queue.executors import WorkerPool


@pytest.fixture
def pool() -> Iterator[WorkerPool]:
    with WorkerPool(1) as pool:
        yield pool


def test_work_is_done_in_another_process_with_one_thread(pool: WorkerPool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    assert pool.submit(os.getenv, "OMP_NUM_THREADS").result(60) == "1"
    assert pool.submit(os.getpid).result(60) != os.getpid()
    assert "OMP_NUM_THREADS" not in os.environ


def test_the_users_own_thread_setting_stays(pool: WorkerPool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert pool.submit(os.getenv, "OMP_NUM_THREADS").result(60) == "3"


def test_a_worker_that_is_killed_breaks_its_work_only(pool: WorkerPool) -> None:
    worker = pool.submit(os.getpid).result(60)
    with pytest.raises(BrokenProcessPool):
        pool.submit(os.kill, worker, signal.SIGKILL).result(60)
    assert pool.submit(os.getpid).result(60) != worker


def test_shutting_down_at_once_ends_work_in_the_middle(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    pool = WorkerPool(1)
    endless = pool.submit((tmp_path / "pipe").read_bytes)
    with (tmp_path / "pipe").open("wb"):  # opens when the worker reads, which goes on until this end is closed
        pool.shutdown(wait=True, cancel_futures=True)
        assert isinstance(endless.exception(60), BrokenProcessPool)
    with pytest.raises(RuntimeError, match="shut down"):
        pool.submit(os.getpid)


SERVICE = """
import os, signal
from tauscope.server.queue.executors import WorkerPool
if __name__ == "__main__":
    pool = WorkerPool(1)
    print(pool.submit(os.getpid).result(60), flush=True)
    pool.submit(signal.pause)
    signal.pause()
"""


def test_no_worker_outlives_a_service_that_is_killed() -> None:
    arguments = [sys.executable, "-c", SERVICE]
    # The worker inherits the pipe's writing end: the pipe ends only when both processes have gone.
    with subprocess.Popen(arguments, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True) as service:
        assert service.stdout is not None
        worker = int(service.stdout.readline())
        assert os.path.exists(f"/proc/{worker}")
        service.kill()
        assert service.stdout.read() == ""
