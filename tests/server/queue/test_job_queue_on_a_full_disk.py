"""The queue where the disk is full: at the beginning, at the end, and in between."""

import contextlib
from pathlib import Path

import pytest

from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.one_kind import make_queue, problem_of, state_of
from tauscope.server.queue.job_folder import JobProblem, Workspace, do_work
from tauscope.server.store.data_folder import ItemStore


def full(*_: object) -> None:
    """In the place of whatever writes."""
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("then", ["there is room again", "restart"])
def test_a_full_disk_when_a_job_ends_does_not_stop_the_queue(
    then: str,
    items: ItemStore,
    executor: ManualExecutor,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    queue = make_queue(items, executor)
    unlucky, following = queue.submit(items.stage()), queue.submit(items.stage())
    write = Workspace.write_record

    def full_once(self: Workspace, record: object) -> None:
        monkeypatch.setattr(Workspace, "write_record", write)
        full()

    monkeypatch.setattr(Workspace, "write_record", full_once)
    executor.run()
    assert state_of(items, following) == "running"
    assert "could not be written" in caplog.text
    if "restart" in then:
        make_queue(items, ManualExecutor())
        assert state_of(items, unlucky) == "running"  # its end was never told: it is done again
    else:
        queue.queue.settle()
        assert state_of(items, unlucky) == "succeeded"


def test_a_full_disk_before_a_job_begins_delays_it(
    items: ItemStore, executor: ManualExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    queue = make_queue(items, executor)
    first, second = queue.submit(items.stage()), queue.submit(items.stage())
    with monkeypatch.context() as patched:
        patched.setattr(Workspace, "write_record", full)
        executor.run()
        with pytest.raises(OSError, match="No space"):
            queue.queue.settle()
    assert [state_of(items, job) for job in (first, second)] == ["running", "queued"]
    queue.queue.settle()
    assert [state_of(items, job) for job in (first, second)] == ["succeeded", "running"]


def test_a_disk_that_is_full_between_a_state_and_its_event_delays_a_job_too(
    items: ItemStore, executor: ManualExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The record says that it runs or has ended already: it is begun, or its end is told, all the same."""
    queue = make_queue(items, executor)
    first, second = queue.submit(items.stage()), queue.submit(items.stage())
    with monkeypatch.context() as patched:
        patched.setattr(Workspace, "_tell_state", full)
        executor.run()
        with contextlib.suppress(OSError):
            queue.queue.settle()
        with contextlib.suppress(OSError):
            queue.queue.settle()
    queue.queue.settle()
    executor.run()
    assert [state_of(items, job) for job in (first, second)] == ["succeeded", "succeeded"]
    assert all(Workspace(items.folder(job)).has_told_end() for job in (first, second))


def test_a_job_that_the_disk_does_not_take_is_no_job(
    items: ItemStore, executor: ManualExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    queue, staged = make_queue(items, executor), items.stage()
    with monkeypatch.context() as patched:
        patched.setattr("tauscope.server.store.data_folder.sync_folder", full)
        with pytest.raises(OSError, match="No space"):
            queue.submit(staged)
    assert (items.identifiers(), queue.queue.waiting(), executor.tasks) == ([], 0, [])
    assert queue.submit(staged) in items.identifiers()


def test_a_full_disk_when_a_waiting_job_is_cancelled(
    items: ItemStore, executor: ManualExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    queue = make_queue(items, executor)
    _, waiting = queue.submit(items.stage()), queue.submit(items.stage())
    monkeypatch.setattr(Workspace, "ask_to_stop", full)
    assert not queue.cancel_or_remove(waiting)
    executor.run()
    assert executor.tasks == []
    assert state_of(items, waiting) == "cancelled"


def test_work_for_which_the_disk_has_no_room_says_so(items: ItemStore) -> None:
    def fill(folder: Path) -> JobProblem | None:
        def work() -> None:
            raise OSError(28, "No space left on device", str(folder))

        return do_work(Workspace(folder), work)

    job = make_queue(items, InlineExecutor(), fill).submit(items.stage())
    assert (state_of(items, job), problem_of(items, job)) == ("failed", "storage-full")
