"""Trials by processes: of this machine, and of a Dask cluster."""

import os
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from concealed.running.kept import Kept
from concealed.running.run import run
from concealed.running.workers import workers
from concealed.sealing.sealed import made
from concealed.sealing.truth import truth_of
from concealed.task import Task
from tauscope.errors import TauscopeError
from tauscope.server.queue.cluster_executor import SCHEDULER


def test_without_a_scheduler_they_are_processes_of_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(SCHEDULER, raising=False)
    with workers(1) as executor:
        assert executor.submit(os.getppid).result(timeout=60) == os.getpid()


def test_without_a_number_they_are_as_many_as_there_are_cores_to_use(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(SCHEDULER, raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 3, 7})
    with workers() as executor:
        assert isinstance(executor, ProcessPoolExecutor)
        assert executor._max_workers == 3  # type: ignore[attr-defined]


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauscope.server.queue.cluster_executor.TIMEOUT_S", 0.2)
    with pytest.raises(TauscopeError, match=r"tcp://127\.0\.0\.1:9"), workers(scheduler="tcp://127.0.0.1:9"):
        pass


@pytest.fixture
def cluster() -> Iterator[str]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from distributed import LocalCluster

        local = LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address="")
        yield local.scheduler_address
        local.close()


@pytest.mark.proof
@pytest.mark.timeout(1200)
@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_makes_the_same_trials(cluster: str, tmp_path: Path) -> None:
    tasks = [Task("sound", seed, "paper") for seed in (2, 3)]
    kept = Kept(tmp_path / "outcomes.jsonl")
    with workers(scheduler=cluster) as executor:
        processes = {each.result() for each in [executor.submit(os.getpid) for _ in range(40)]}
        run(tasks, kept, executor, lambda each: None)
    assert os.getpid() not in processes
    assert len(kept.outcomes) == 2
    for task, each in zip(tasks, kept.of({task.key for task in tasks}), strict=True):
        assert "error" not in each
        case, trial = made(task.series, task.seed, task.arm)
        assert truth_of(trial, case).seal(tmp_path / "truth.json") == each["seal"]
        assert not each["score"]["claimed"]
