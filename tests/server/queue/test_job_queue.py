"""The queue: order, slots, cancelling, failures of every kind, restart."""

import shutil
from concurrent.futures import BrokenExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.one_kind import make_queue, problem_of, state_of, succeed
from tauscope.errors import NotFoundError
from tauscope.server.queue.job_folder import JobProblem, JobState, Workspace
from tauscope.server.queue.queue import MOST_ATTEMPTS, JobKind, JobQueue, QueueFullError, Work
from tauscope.server.store.data_folder import ItemStore


def fail(_: Path) -> JobProblem:
    return JobProblem(code="recording", detail="a.csv: row 3")


def crash(_: Path) -> None:
    raise ZeroDivisionError("a bug")


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


def test_a_job_whose_worker_was_killed_is_done_again(items: ItemStore, executor: ManualExecutor) -> None:
    queue = make_queue(items, executor)
    job = queue.submit(items.stage())
    executor.fail(BrokenProcessPool("killed"))
    executor.run()
    assert state_of(items, job) == "succeeded"


def test_light_jobs_pass_heavy_ones(tmp_path: Path, executor: ManualExecutor) -> None:
    heavy = JobKind(ItemStore(tmp_path / "heavy", "job"), succeed, is_heavy=True)
    light = JobKind(ItemStore(tmp_path / "light", "job"), succeed)
    queue = JobQueue([heavy, light], executor, slots=2, most_waiting=10)
    first, second = (queue.submit(heavy, heavy.items.stage()) for _ in range(2))
    quick = queue.submit(light, light.items.stage())
    states = [state_of(heavy.items, first), state_of(heavy.items, second), state_of(light.items, quick)]
    assert states == ["running", "queued", "running"]
    executor.run()
    assert [state_of(heavy.items, each) for each in (first, second)] == ["succeeded", "running"]


def test_a_caller_has_so_many_jobs_and_others_have_room(items: ItemStore, executor: ManualExecutor) -> None:
    kind = JobKind(items, succeed)
    queue = JobQueue([kind], executor, slots=1, most_waiting=10, most_each=2)
    first, _ = (queue.submit(kind, items.stage(), "flood") for _ in range(2))
    with pytest.raises(QueueFullError, match="2 jobs of flood have not ended"):
        queue.submit(kind, items.stage(), "flood")
    queue.submit(kind, items.stage(), "other")
    executor.run()
    assert state_of(items, first) == "succeeded"
    queue.submit(kind, items.stage(), "flood")


def test_a_worker_that_dies_again_and_again_fails_its_job_and_the_next_one_runs(
    items: ItemStore, executor: ManualExecutor
) -> None:
    queue = make_queue(items, executor)
    lost, following = queue.submit(items.stage()), queue.submit(items.stage())
    for _ in range(MOST_ATTEMPTS):
        assert state_of(items, lost) == "running"
        executor.fail(BrokenProcessPool("killed"))
    assert (state_of(items, lost), problem_of(items, lost)) == ("failed", "worker-lost")
    executor.run()
    assert state_of(items, following) == "succeeded"


@pytest.mark.parametrize("refusal", [BrokenExecutor("broken"), RuntimeError("shut down"), OSError("no process")])
def test_an_executor_that_takes_nothing(refusal: Exception, items: ItemStore, executor: ManualExecutor) -> None:
    executor.refusal = refusal
    job = make_queue(items, executor).submit(items.stage())
    assert (state_of(items, job), problem_of(items, job)) == ("failed", "worker-lost")


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
