"""The Dask cluster behind the executor: results, failures, a worker that dies, and a scheduler that is not there."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Future, wait
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from patience import eventually
from server.queue.paper_files import PAPER_ROBOT, write_recording
from server.queue.waiting import wait_until
from tauscope.errors import StoreError
from tauscope.server.queue.analyses import IdentificationOrder, IdentificationWorkspace
from tauscope.server.queue.cluster_executor import SCHEDULER, ClusterExecutor, ClusterUnavailableError, open_executor
from tauscope.server.queue.job_folder import JobState, Workspace
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.queue.task_job import OrderedRecording, perform_job
from tauscope.server.queue.worker_pool import WorkerPool
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.files import hash_file

if TYPE_CHECKING:
    from distributed import LocalCluster

CLUSTER = [pytest.mark.slow, pytest.mark.timeout(1200), pytest.mark.filterwarnings("ignore")]


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
    monkeypatch.setattr("tauscope.server.queue.cluster_executor.TIMEOUT_S", 0.2)
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
        future: Future[object] = executor.submit(perform_job, IdentificationWorkspace, tmp_path, workspace.folder)
        wait([future], 120)
        assert future.result(0) is None
        assert workspace.read_result() is not None


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def dask(program: str, *words: str) -> Iterator["subprocess.Popen[bytes]"]:
    """A scheduler or a worker of its own, killed on leaving."""
    command = [sys.executable, "-m", f"distributed.cli.dask_{program}", *words, "--no-dashboard"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}  # workers import what is done
    nowhere = subprocess.DEVNULL
    with subprocess.Popen(command, env=environment, stdout=nowhere, stderr=nowhere) as process:
        try:
            yield process
        finally:
            process.kill()


def stay(folder: Path) -> None:
    """Work that ends by itself only where somebody says that it may; whoever is killed in it ends too."""
    (folder / "begun").touch()
    while not (folder.parent.parent / "go").exists():
        time.sleep(0.05)


class TestASchedulerThatDies:
    pytestmark = CLUSTER

    def test_its_jobs_are_done_when_it_is_back(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """It is away for so long that Dask's own client gives up for good."""
        pytest.importorskip("distributed", reason="needs tauscope[fleet]")
        monkeypatch.setattr("tauscope.server.queue.cluster_executor.TIMEOUT_S", 3)
        port = str(free_port())
        address = f"tcp://127.0.0.1:{port}"
        scheduler = ("scheduler", "--host", "127.0.0.1", "--port", port)
        worker = ("worker", address, "--nworkers", "1", "--nthreads", "1", "--no-nanny")
        monkeypatch.setenv(SCHEDULER, address)
        items = ItemStore(tmp_path / "jobs", "job")
        kind = JobKind(items, stay)
        with ExitStack() as later:
            with dask(*scheduler), dask(*worker):
                executor = opened_when_there(address)
                later.callback(executor.shutdown, cancel_futures=True)
                queue = JobQueue(
                    [kind], executor, slots=lambda: executor.width, most_waiting=9, is_there=executor.is_there
                )
                running, waiting = (queue.submit(kind, items.stage()) for _ in range(2))
                assert eventually((items.folder(running) / "begun").exists, 60)
            assert eventually(lambda: executor._client.status == "closed", 60)
            assert not queue.can_work()
            with pytest.raises(ClusterUnavailableError):
                executor.submit(divide, 1)
            added = queue.submit(kind, items.stage())
            assert {state(items, job) for job in (running, waiting, added)} == {"queued"}
            (tmp_path / "go").touch()
            later.enter_context(dask(*scheduler))
            later.enter_context(dask(*worker))

            def are_done() -> bool:
                queue.settle()  # as housekeeping does
                return {state(items, job) for job in (running, waiting, added)} == {"succeeded"}

            assert eventually(are_done, 90)

    @pytest.mark.parametrize("is_given_up", [False, True], ids=["a moment ago", "given up by Dask"])
    def test_it_is_left_in_good_order_all_the_same(self, is_given_up: bool, monkeypatch: pytest.MonkeyPatch) -> None:
        pytest.importorskip("distributed", reason="needs tauscope[fleet]")
        monkeypatch.setattr("tauscope.server.queue.cluster_executor.TIMEOUT_S", 3)
        port = str(free_port())
        address = f"tcp://127.0.0.1:{port}"
        with dask("scheduler", "--host", "127.0.0.1", "--port", port):
            executor = opened_when_there(address)
            future = executor.submit(divide, 1)
        status = "closed" if is_given_up else "connecting"
        assert eventually(lambda: executor._client.status == status, 60)
        executor.shutdown(cancel_futures=True)
        assert future.done()
        with pytest.raises(RuntimeError, match="was left"):
            executor.submit(divide, 1)

    def test_reaching_for_it_again_and_again_leaves_nothing_behind(self, monkeypatch: pytest.MonkeyPatch) -> None:
        pytest.importorskip("distributed", reason="needs tauscope[fleet]")
        monkeypatch.setattr("tauscope.server.queue.cluster_executor.TIMEOUT_S", 1)
        monkeypatch.setattr("tauscope.server.queue.cluster_executor.CHECK_S", 0.01)
        before = set(threading.enumerate())
        failures: list[OSError] = []
        open_client = ClusterExecutor._open_client

        def counted(executor: ClusterExecutor) -> Any:
            try:
                return open_client(executor)
            except OSError as error:
                failures.append(error)
                raise

        port = str(free_port())
        with dask("scheduler", "--host", "127.0.0.1", "--port", port):
            executor = opened_when_there(f"tcp://127.0.0.1:{port}")
            monkeypatch.setattr(ClusterExecutor, "_open_client", counted)
        assert eventually(lambda: len(failures) >= 3, 60)
        assert names_of_threads_but(before) == {"cluster", "cluster loop"}
        executor.shutdown(cancel_futures=True)
        assert eventually(lambda: not names_of_threads_but(before), 30)

    def test_workers_that_come_later_are_counted(self) -> None:
        pytest.importorskip("distributed", reason="needs tauscope[fleet]")
        port = str(free_port())
        address = f"tcp://127.0.0.1:{port}"
        with dask("scheduler", "--host", "127.0.0.1", "--port", port):
            executor = opened_when_there(address)
            assert executor.width == 1  # nobody is there, and whoever comes first has something to do
            with dask("worker", address, "--nworkers", "1", "--nthreads", "3", "--no-nanny"):
                wait_until(lambda: executor.width == 3)
            executor.shutdown(cancel_futures=True)


def names_of_threads_but(before: set[threading.Thread]) -> set[str]:
    """Those that came meanwhile, less the one that serves all of Dask in a process."""
    return {each.name for each in set(threading.enumerate()) - before if not each.name.startswith("Dask-Offload")}


def opened_when_there(address: str) -> ClusterExecutor:
    """The scheduler needs a moment to start."""
    found: list[ClusterExecutor] = []

    def is_there() -> bool:
        try:
            found.append(ClusterExecutor(address))
        except StoreError:
            return False
        return True

    assert eventually(is_there, 60)
    return found[0]


def state(items: ItemStore, job: str) -> JobState:
    record = Workspace(items.folder(job)).read_record()
    assert record is not None
    return record.state
