"""The queue with a Dask cluster that goes away, comes back, or grows."""

import pytest

from server.queue.executors import ManualExecutor
from server.queue.one_kind import make_queue, problem_of, state_of, succeed
from tauscope.server.queue.cluster_executor import ClusterUnavailableError
from tauscope.server.queue.queue import MOST_ATTEMPTS, JobKind, JobQueue
from tauscope.server.store.data_folder import ItemStore


def test_a_job_that_was_lost_with_its_cluster_is_done_again_before_the_others(
    items: ItemStore, executor: ManualExecutor
) -> None:
    queue = make_queue(items, executor)
    lost, following = queue.submit(items.stage()), queue.submit(items.stage())
    executor.fail(ClusterUnavailableError("the scheduler is gone"))
    assert (state_of(items, lost), state_of(items, following)) == ("running", "queued")
    executor.run()
    assert state_of(items, lost) == "succeeded"
    executor.run()
    assert state_of(items, following) == "succeeded"


def test_a_job_that_takes_its_cluster_along_is_not_done_for_ever(items: ItemStore, executor: ManualExecutor) -> None:
    job = make_queue(items, executor).submit(items.stage())
    for _ in range(MOST_ATTEMPTS):
        executor.fail(ClusterUnavailableError("the scheduler is gone"))
    assert executor.tasks == []
    assert (state_of(items, job), problem_of(items, job)) == ("failed", "worker-lost")


def test_a_job_that_was_cancelled_while_its_cluster_went_stays_cancelled(
    items: ItemStore, executor: ManualExecutor
) -> None:
    queue = make_queue(items, executor)
    job = queue.submit(items.stage())
    queue.cancel_or_remove(job)
    executor.fail(ClusterUnavailableError("the scheduler is gone"))
    assert executor.tasks == []
    assert state_of(items, job) == "cancelled"


@pytest.mark.parametrize("is_known", [True, False], ids=["known before", "noticed by the hand-over"])
def test_jobs_wait_for_a_cluster_that_is_away(is_known: bool, items: ItemStore, executor: ManualExecutor) -> None:
    there = [not is_known]

    class Away(ManualExecutor):
        def submit(self, fn, /, *args, **kwargs):
            there[0] = False
            raise ClusterUnavailableError("the scheduler is gone")

    gone, kind = Away(), JobKind(items, succeed)
    queue = JobQueue([kind], gone, slots=1, most_waiting=2, is_there=lambda: there[0])
    jobs = [queue.submit(kind, items.stage()) for _ in range(2)]
    assert not queue.can_work()
    for _ in range(2 * MOST_ATTEMPTS):  # however long it takes
        queue.settle()
    assert [state_of(items, job) for job in jobs] == ["queued", "queued"]
    gone.submit = executor.submit  # type: ignore[method-assign]
    there[0] = True
    queue.settle()
    executor.run()
    executor.run()
    assert [state_of(items, job) for job in jobs] == ["succeeded", "succeeded"]


def test_workers_that_come_later_are_made_use_of(items: ItemStore, executor: ManualExecutor) -> None:
    width, kind = [1], JobKind(items, succeed)
    queue = JobQueue([kind], executor, slots=lambda: width[0], most_waiting=5)
    for _ in range(4):
        queue.submit(kind, items.stage())
    assert len(executor.tasks) == 1
    width[0] = 3
    queue.settle()
    assert len(executor.tasks) == 3
