"""The queue: order, slots, cancelling, failures of every kind, restart."""

import contextlib
import shutil
from concurrent.futures import BrokenExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from jobs.executors import InlineExecutor, ManualExecutor
from service.errors import NotFoundError
from service.jobs import JobKind, JobProblem, JobQueue, JobState, QueueFullError, Workspace
from service.jobs.cluster_executor import ClusterAwayError
from service.jobs.queued_job import MOST_ATTEMPTS, Work
from service.jobs.work import do_work
from service.store import ItemStore


@pytest.fixture
def items(tmp_path: Path) -> ItemStore:
    return ItemStore(tmp_path / "jobs", "job")


@pytest.fixture
def executor() -> ManualExecutor:
    return ManualExecutor()


def succeed(_: Path) -> None:
    return None


def fail(_: Path) -> JobProblem:
    return JobProblem(code="recording", detail="a.csv: row 3")


def crash(_: Path) -> None:
    raise ZeroDivisionError("a bug")


class OneKind:
    """A queue of jobs of one kind."""

    def __init__(self, items: ItemStore, executor: ManualExecutor, work: Work, slots: int) -> None:
        self.kind = JobKind(items, work)
        self.queue = JobQueue([self.kind], executor, slots=slots, most_waiting=2)
        self.close = self.queue.close

    def submit(self, staged: Path) -> str:
        return self.queue.submit(self.kind, staged)

    def cancel_or_remove(self, identifier: str) -> bool:
        return self.queue.cancel_or_remove(self.kind, identifier)


def make_queue(items: ItemStore, executor: ManualExecutor, work: Work = succeed, slots: int = 1) -> OneKind:
    return OneKind(items, executor, work, slots)


def state_of(items: ItemStore, identifier: str) -> JobState:
    record = Workspace(items.folder(identifier)).read_record()
    assert record is not None
    return record.state


def problem_of(items: ItemStore, identifier: str) -> str:
    record = Workspace(items.folder(identifier)).read_record()
    assert record is not None
    assert record.problem is not None
    return record.problem.code


@pytest.mark.parametrize("slots", [1, 2])
def test_jobs_run_in_their_order_and_never_more_than_there_are_slots(
    slots: int, items: ItemStore, executor: ManualExecutor
) -> None:
    queue = make_queue(items, executor, slots=slots)
    jobs = [queue.submit(items.stage()) for _ in range(3)]
    states = [state_of(items, job) for job in jobs]
    assert states == ["running"] * slots + ["queued"] * (3 - slots)
    for done in range(3):
        assert len(executor.tasks) == min(slots, 3 - done)
        executor.run()
        assert state_of(items, jobs[done]) == "succeeded"
    assert executor.tasks == []


@pytest.mark.parametrize(
    ("work", "state", "code"), [(fail, JobState.FAILED, "recording"), (crash, JobState.FAILED, "internal")]
)
def test_work_that_fails(work: Work, state: JobState, code: str, items: ItemStore) -> None:
    job = make_queue(items, InlineExecutor(), work).submit(items.stage())
    assert (state_of(items, job), problem_of(items, job)) == (state, code)


def test_an_unforeseen_failure_is_logged_and_not_told(items: ItemStore, caplog: pytest.LogCaptureFixture) -> None:
    job = make_queue(items, InlineExecutor(), crash).submit(items.stage())
    record = Workspace(items.folder(job)).read_record()
    assert record is not None
    assert "a bug" not in str(record.problem)
    assert "ZeroDivisionError: a bug" in caplog.text


def test_a_worker_that_dies_fails_its_job_and_the_next_one_runs(items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor)
    lost, following = queue.submit(items.stage()), queue.submit(items.stage())
    executor.fail(BrokenProcessPool("killed"))
    assert (state_of(items, lost), problem_of(items, lost)) == ("failed", "worker-lost")
    executor.run()
    assert state_of(items, following) == "succeeded"


@pytest.mark.parametrize("refusal", [BrokenExecutor("broken"), RuntimeError("shut down"), OSError("no process")])
def test_an_executor_that_takes_nothing(refusal: Exception, items: ItemStore, executor: ManualExecutor) -> None:
    executor.refusal = refusal
    job = make_queue(items, executor).submit(items.stage())
    assert (state_of(items, job), problem_of(items, job)) == ("failed", "worker-lost")


def test_a_job_that_was_lost_with_its_cluster_is_done_again_before_the_others(
    items: ItemStore, executor: ManualExecutor
) -> None:
    queue = make_queue(items, executor)
    lost, following = queue.submit(items.stage()), queue.submit(items.stage())
    executor.fail(ClusterAwayError("the scheduler is gone"))
    assert (state_of(items, lost), state_of(items, following)) == ("running", "queued")
    executor.run()
    assert state_of(items, lost) == "succeeded"
    executor.run()
    assert state_of(items, following) == "succeeded"


def test_a_job_that_takes_its_cluster_along_is_not_done_for_ever(items: ItemStore, executor: ManualExecutor) -> None:
    job = make_queue(items, executor).submit(items.stage())
    for _ in range(MOST_ATTEMPTS):
        executor.fail(ClusterAwayError("the scheduler is gone"))
    assert executor.tasks == []
    assert (state_of(items, job), problem_of(items, job)) == ("failed", "worker-lost")


def test_a_job_that_was_cancelled_while_its_cluster_went_stays_cancelled(
    items: ItemStore, executor: ManualExecutor
) -> None:
    queue = make_queue(items, executor)
    job = queue.submit(items.stage())
    queue.cancel_or_remove(job)
    executor.fail(ClusterAwayError("the scheduler is gone"))
    assert executor.tasks == []
    assert state_of(items, job) == "cancelled"


@pytest.mark.parametrize("is_known", [True, False], ids=["known before", "noticed by the hand-over"])
def test_jobs_wait_for_a_cluster_that_is_away(is_known: bool, items: ItemStore, executor: ManualExecutor) -> None:
    there = [not is_known]

    class Away(ManualExecutor):
        def submit(self, fn, /, *args, **kwargs):
            there[0] = False
            raise ClusterAwayError("the scheduler is gone")

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


def test_too_many_waiting_jobs(items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor)
    for _ in range(3):
        queue.submit(items.stage())
    staged = items.stage()
    with pytest.raises(QueueFullError, match="2 jobs are waiting already"):
        queue.submit(staged)
    assert len(items.identifiers()) == 3
    executor.run()
    queue.submit(staged)
    assert len(items.identifiers()) == 4


def test_a_waiting_job_is_cancelled_and_never_runs(items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor)
    _, waiting = queue.submit(items.stage()), queue.submit(items.stage())
    assert not queue.cancel_or_remove(waiting)
    executor.run()
    assert executor.tasks == []
    assert (state_of(items, waiting), problem_of(items, waiting)) == ("cancelled", "cancelled")


def test_a_running_job_is_cancelled_at_once_and_told_to_stop(items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor)
    job = queue.submit(items.stage())
    workspace = Workspace(items.folder(job))
    assert not workspace.is_asked_to_stop()
    queue.cancel_or_remove(job)
    assert state_of(items, job) == "cancelled"
    assert workspace.is_asked_to_stop()
    executor.run()  # the work ends in its own time, and what it says then does not count
    assert state_of(items, job) == "cancelled"


def test_the_slot_of_a_cancelled_job_is_taken_until_its_work_ends(items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor)
    cancelled, following = queue.submit(items.stage()), queue.submit(items.stage())
    queue.cancel_or_remove(cancelled)
    queue.cancel_or_remove(cancelled)  # removed, while its work goes on
    assert items.identifiers() == [following]
    assert state_of(items, following) == "queued"
    executor.run()
    assert state_of(items, following) == "running"


def test_an_ended_job_is_removed(items: ItemStore) -> None:
    queue = make_queue(items, InlineExecutor())
    job = queue.submit(items.stage())
    assert queue.cancel_or_remove(job)
    assert items.identifiers() == []
    with pytest.raises(NotFoundError):
        queue.cancel_or_remove(job)


@pytest.mark.parametrize("damage", [b"", b"{}", b"\xff\xfe", b'{"state": "flying"}', b'{"state": 1}', b"[" * 100_000])
def test_a_job_with_a_damaged_record_can_be_removed(damage: bytes, items: ItemStore) -> None:
    queue = make_queue(items, InlineExecutor())
    job = queue.submit(items.stage())
    (items.folder(job) / "state.json").write_bytes(damage)
    assert Workspace(items.folder(job)).read_record() is None
    assert queue.cancel_or_remove(job)


def test_what_an_earlier_service_left_unfinished_is_done_again_in_its_order(
    items: ItemStore, executor: ManualExecutor
) -> None:
    earlier = make_queue(items, executor)
    done = earlier.submit(items.stage())
    executor.run()
    running, waiting = earlier.submit(items.stage()), earlier.submit(items.stage())
    half_staged = items.stage()
    # The earlier service is killed here: nothing of it runs any more.
    again = ManualExecutor()
    make_queue(items, again)
    assert [state_of(items, job) for job in (done, running, waiting)] == ["succeeded", "running", "queued"]
    for _ in range(2):
        again.run()
    assert again.tasks == []
    assert [state_of(items, job) for job in (running, waiting)] == ["succeeded"] * 2
    assert not half_staged.exists()


def test_a_job_that_brings_the_service_down_is_not_done_for_ever(items: ItemStore) -> None:
    deadly = make_queue(items, ManualExecutor()).submit(items.stage())
    states = []
    for _ in range(4):
        make_queue(items, ManualExecutor())  # killed in the middle of it, again and again
        states.append(state_of(items, deadly))
    assert states == ["running", "running", "interrupted", "interrupted"]
    assert problem_of(items, deadly) == "interrupted"


def test_ending_in_good_order_counts_as_no_attempt(items: ItemStore) -> None:
    job = make_queue(items, ManualExecutor()).submit(items.stage())
    for _ in range(10):
        queue = make_queue(items, ManualExecutor())
        assert state_of(items, job) == "running"
        queue.close()
        assert state_of(items, job) == "queued"


def test_closing_leaves_jobs_for_the_next_start_and_takes_nothing_more(
    items: ItemStore, executor: ManualExecutor
) -> None:
    queue = make_queue(items, executor)
    running, waiting = queue.submit(items.stage()), queue.submit(items.stage())
    queue.close()
    assert executor.shutdowns == [True]
    assert [state_of(items, job) for job in (running, waiting)] == ["queued", "queued"]
    with pytest.raises(QueueFullError):
        queue.submit(items.stage())


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
        raise OSError(28, "No space left on device")

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


def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Workspace, "write_record", full)


def test_a_full_disk_before_a_job_begins_delays_it(
    items: ItemStore, executor: ManualExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    queue = make_queue(items, executor)
    first, second = queue.submit(items.stage()), queue.submit(items.stage())
    with monkeypatch.context() as patched:
        full_disk(patched)
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

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

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
    def full(_: Path) -> None:
        raise OSError(28, "No space left on device")

    queue, staged = make_queue(items, executor), items.stage()
    with monkeypatch.context() as patched:
        patched.setattr("service.store.items.sync_folder", full)
        with pytest.raises(OSError, match="No space"):
            queue.submit(staged)
    assert (items.identifiers(), queue.queue.waiting(), executor.tasks) == ([], 0, [])
    assert queue.submit(staged) in items.identifiers()


@pytest.mark.parametrize("loss", ["damaged and removed", "gone"])
def test_a_waiting_job_that_is_lost_holds_up_nobody(loss: str, items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor)
    _, lost, following = (queue.submit(items.stage()) for _ in range(3))
    if loss == "gone":
        shutil.rmtree(items.folder(lost))
    else:
        (items.folder(lost) / "state.json").write_bytes(b"")
        assert queue.cancel_or_remove(lost)
    executor.run()
    assert state_of(items, following) == "running"
    assert len(executor.tasks) == 1


def test_a_full_disk_when_a_waiting_job_is_cancelled(
    items: ItemStore, executor: ManualExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: Workspace) -> None:
        raise OSError(28, "No space left on device")

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


def test_jobs_of_several_kinds_take_their_turns(tmp_path: Path, executor: ManualExecutor) -> None:
    first, second = (JobKind(ItemStore(tmp_path / noun, noun), succeed) for noun in ("first", "second"))
    queue = JobQueue([first, second], executor, slots=1, most_waiting=2)
    jobs = [(kind, queue.submit(kind, kind.items.stage())) for kind in (first, second, first)]
    for done in range(3):
        states = [state_of(kind.items, job) for kind, job in jobs]
        assert states == ["succeeded"] * done + ["running"] + ["queued"] * (2 - done)
        executor.run()
    with pytest.raises(NotFoundError, match="no second"):
        queue.cancel_or_remove(second, jobs[0][1])


def events_of(items: ItemStore, identifier: str) -> list[tuple[str, str | None]]:
    """Kind and state of every event."""
    log = Workspace(items.folder(identifier)).events.follow().read()
    assert [event.number for event in log] == list(range(1, len(log) + 1))
    return [(event.content["kind"], event.content.get("state")) for event in log]


def test_every_change_of_state_is_told(items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor, fail)
    done, cancelled = queue.submit(items.stage()), queue.submit(items.stage())
    queue.cancel_or_remove(cancelled)
    executor.run()
    assert events_of(items, done) == [("state", "queued"), ("state", "running"), ("ended", "failed")]
    assert events_of(items, cancelled) == [("state", "queued"), ("ended", "cancelled")]
    ended = Workspace(items.folder(done)).events.last()
    assert ended is not None
    assert ended["problem"] == {"code": "recording", "detail": "a.csv: row 3"}


@pytest.mark.parametrize("loss", ["all", "the end", "none"])
def test_the_end_is_told_by_the_next_start_where_it_is_missing(loss: str, items: ItemStore) -> None:
    job = make_queue(items, InlineExecutor()).submit(items.stage())
    log = Workspace(items.folder(job)).events.path
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join({"all": [], "the end": lines[:-1], "none": lines}[loss]))
    make_queue(items, ManualExecutor())
    make_queue(items, ManualExecutor())
    kinds = [kind for kind, _ in events_of(items, job)]
    assert kinds == (["ended"] if loss == "all" else ["state", "state", "ended"])


def test_events_that_cannot_be_written_do_not_stop_the_job(
    items: ItemStore, executor: ManualExecutor, caplog: pytest.LogCaptureFixture
) -> None:
    queue = make_queue(items, executor)
    job = queue.submit(items.stage())
    Workspace(items.folder(job)).events.path.unlink()
    Workspace(items.folder(job)).events.path.mkdir()
    executor.run()
    assert state_of(items, job) == "succeeded"
    assert "an event of job" in caplog.text
