"""Worker processes: one dies, the pool goes on; the service goes, they go too."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from shared_data import REPOSITORY
from tauscope.errors import LimitExceededError
from tauscope.server.queue.worker_pool import WorkerPool


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


def test_a_worker_that_is_killed_takes_nothing_of_its_neighbour(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with WorkerPool(2) as pool:
        neighbour = pool.submit((tmp_path / "pipe").read_bytes)
        with (tmp_path / "pipe").open("wb") as pipe:
            with pytest.raises(BrokenProcessPool):
                pool.submit(signal.raise_signal, signal.SIGKILL).result(60)
            pipe.write(b"whole")
        assert neighbour.result(60) == b"whole"


def test_work_beyond_its_deadline_is_ended() -> None:
    with WorkerPool(1, deadline_s=0.3) as pool:
        with pytest.raises(LimitExceededError, match=r"took longer than the 0.3 s"):
            pool.submit(signal.pause).result(60)
        assert pool.submit(os.getpid).result(60)


def test_work_beyond_its_memory_is_ended() -> None:
    with WorkerPool(1, memory_bytes=300 * 2**20) as pool:
        with pytest.raises(LimitExceededError, match="more than the 300 MiB of memory"):
            pool.submit(bytes, 400 * 2**20).result(60)
        assert pool.submit(len, bytes(2**20)).result(60) == 2**20


def test_cancelled_work_ends_at_once_in_the_middle() -> None:
    with WorkerPool(1) as pool:
        worker = pool.submit(os.getpid).result(60)
        endless = pool.submit(signal.pause)
        time.sleep(0.1)
        assert endless.cancel()
        assert pool.submit(os.getpid).result(60) != worker
        assert not os.path.exists(f"/proc/{worker}")


def test_a_failure_says_where_it_happened(pool: WorkerPool) -> None:
    error = pool.submit(int, "many").exception(60)
    assert isinstance(error, ValueError)
    assert "worker_pool.py" in error.__notes__[0]


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
from tauscope.errors import LimitExceededError
from tauscope.server.queue.worker_pool import WorkerPool
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
