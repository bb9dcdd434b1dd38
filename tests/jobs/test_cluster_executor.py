"""The Dask cluster behind the executor: results, failures, a worker that dies, and a scheduler that is not there."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Future, wait
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from jobs.paper_files import PAPER_ROBOT, write_recording
from service.errors import StoreError
from service.jobs import IdentificationOrder, IdentificationWorkspace, OrderedRecording, run_identification
from service.jobs.executors import SCHEDULER, ClusterExecutor, open_executor
from service.jobs.worker_pool import WorkerPool
from service.store import hash_file

if TYPE_CHECKING:
    from distributed import LocalCluster

CLUSTER = [pytest.mark.slow, pytest.mark.timeout(180), pytest.mark.filterwarnings("ignore")]


def die(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def divide(number: int) -> float:
    return 1 / number


@pytest.fixture(scope="module")
def cluster() -> Iterator["LocalCluster"]:
    distributed = pytest.importorskip("distributed", reason="needs tauscope[fleet]")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as started:
        yield started


@pytest.fixture
def executor(cluster: "LocalCluster", monkeypatch: pytest.MonkeyPatch) -> Iterator[ClusterExecutor]:
    monkeypatch.setenv(SCHEDULER, cluster.scheduler_address)
    opened = open_executor(1)
    assert isinstance(opened, ClusterExecutor)
    yield opened
    opened.shutdown(cancel_futures=True)


def test_without_a_cluster_it_is_processes_of_our_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(SCHEDULER, raising=False)
    opened = open_executor(1)
    assert isinstance(opened, WorkerPool)
    opened.shutdown()


@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="needs tauscope[fleet]")
    monkeypatch.setattr("service.jobs.executors.PATIENCE_S", 0.2)
    monkeypatch.setenv(SCHEDULER, "tcp://127.0.0.1:1")
    with pytest.raises(StoreError, match=r"DASK_SCHEDULER_ADDRESS=tcp://127\.0\.0\.1:1: does not answer"):
        open_executor(1)


class TestOnACluster:
    pytestmark = CLUSTER

    def test_results_and_failures(self, executor: ClusterExecutor) -> None:
        assert executor.width == 2
        assert executor.submit(divide, 4).result(60) == 0.25
        with pytest.raises(ZeroDivisionError):
            executor.submit(divide, 0).result(60)
        first, second = (executor.submit(os.urandom, 8).result(60) for _ in range(2))
        assert first != second  # the same call is done again, not remembered

    def test_a_task_that_kills_its_worker_is_lost_and_the_next_one_is_not(self, executor: ClusterExecutor) -> None:
        with pytest.raises(BrokenExecutor):
            executor.submit(die, 1).result(120)
        assert executor.submit(divide, 2).result(60) == 0.5

    def test_an_identification(self, executor: ClusterExecutor, tmp_path: Path) -> None:
        workspace = IdentificationWorkspace(tmp_path / "job")
        workspace.folder.mkdir()
        workspace.prepare()
        (workspace.robot / "arm.yaml").write_bytes(PAPER_ROBOT.read_bytes())
        recording = write_recording(tmp_path / "a.csv", seed=1)
        ordered = OrderedRecording(name="a.csv", origin="server", sha256=hash_file(recording))
        order = IdentificationOrder(robot_file="arm.yaml", robot_name="paper-arm", recordings=(ordered,))
        workspace.write_order(order)
        future: Future[object] = executor.submit(run_identification, workspace.folder, server_recordings=tmp_path)
        wait([future], 120)
        assert future.result(0) is None
        assert workspace.read_result() is not None
