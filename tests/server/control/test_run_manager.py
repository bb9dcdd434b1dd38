"""Runs: led to their end, stopped in every state, one an arm, found interrupted after a restart."""

import threading
from pathlib import Path

import pytest

from server.queue.controls import CSV, WAY, HandControls
from server.queue.waiting import wait_until
from tauscope.errors import AcquisitionError, NotFoundError
from tauscope.runtime.record import RunProblem
from tauscope.runtime.states import RunState
from tauscope.server.control.leases import BusyError, DeviceClaims
from tauscope.server.control.run import Motion, RunRequestRecord, RunWorkspace, StepFailedError, ready_motion
from tauscope.server.control.run_manager import RunManager, run_recording_name
from tauscope.server.queue.job_folder import JobProblem
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.recordings import RecordingStore
from tauscope.tasks.run import BackendChoice


class Bench:
    """A manager whose control processes the test moves."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.controls = HandControls()
        self.claims = DeviceClaims(2)
        self.alive = True
        self.recordings = RecordingStore(folder / "recordings")
        self.manager = self.open()

    def open(self) -> RunManager:
        items = ItemStore(self.folder / "runs", "run")
        return RunManager(items, self.recordings, self.controls, self.claims, lambda: self.alive)

    def submit(self, motion: Motion = ready_motion, device: str = "arm on sim", holder: str | None = None) -> str:
        staged = self.manager.items.stage()
        workspace = RunWorkspace(staged)
        workspace.prepare()
        (workspace.trajectories / "trajectory.json").touch()
        backend = BackendChoice(name="sim")
        workspace.write_order(RunRequestRecord(robot_file="arm.yaml", robot_name="arm", backend=backend, device=device))
        try:
            return self.manager.submit(staged, motion, holder)
        finally:
            self.manager.items.discard(staged)

    def workspace(self, run: str) -> RunWorkspace:
        return RunWorkspace(self.manager.items.folder(run))

    def state(self, run: str) -> RunState:
        record = self.workspace(run).read_record()
        assert record is not None
        return record.state

    def ended(self, run: str) -> RunState:
        wait_until(lambda: self.manager.live(run) is None)
        return self.state(run)

    def told(self, run: str) -> list[str | float | None]:
        """States and percentages of the events."""
        events = [event.content for event in self.workspace(run).events.follow().read()]
        return [event.get("state") or event.get("percent") or event.get("step") for event in events]


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_a_run_from_its_beginning_to_its_end(bench: Bench) -> None:
    run = bench.submit()
    control = bench.controls.next()
    control.go(RunState.RUNNING)
    control.progress(40.0)
    live = bench.manager.live(run)
    assert live is not None
    assert (live.state, live.percent, live.figures["missed_periods"]) == (RunState.RUNNING, 40.0, 3)
    control.finish()
    assert bench.ended(run) is RunState.FINISHED
    assert bench.told(run) == [*(state.value for state in WAY), 40.0, "stopping", "finished"]
    kept = bench.recordings.path(run_recording_name(run))
    assert kept.read_text(encoding="utf-8") == CSV
    assert kept.samefile(bench.workspace(run).recording("csv"))


def test_an_arm_has_one_run_at_a_time_and_others_have_theirs(bench: Bench) -> None:
    first = bench.submit()
    with pytest.raises(BusyError, match=f"arm on sim: run {first} has it"):
        bench.submit()
    other = bench.submit(device="other arm")
    with pytest.raises(BusyError, match="2 arms move already"):
        bench.submit(device="third arm")
    assert sorted(bench.manager.items.identifiers()) == sorted([first, other])
    for number in (1, 2):
        bench.controls.next(number).finish()
    bench.ended(first)
    following = bench.submit()
    bench.controls.next(3).finish()
    assert bench.ended(following) is RunState.FINISHED


def test_who_has_the_arm_may_run_again_and_again(bench: Bench) -> None:
    bench.claims.take("arm on sim", "campaign c")
    with pytest.raises(BusyError, match="campaign c has it"):
        bench.submit()
    for number in (1, 2):
        run = bench.submit(holder="campaign c")
        bench.controls.next(number).finish()
        bench.ended(run)
        with pytest.raises(BusyError):
            bench.submit()
    bench.claims.release("arm on sim", "somebody else")
    with pytest.raises(BusyError):
        bench.submit()


@pytest.mark.parametrize("state", WAY)
def test_stop_reaches_the_control_process_in_every_state(state: RunState, bench: Bench) -> None:
    run = bench.submit()
    control = bench.controls.next()
    control.go(state)
    for _ in range(3):
        assert bench.manager.stop(run) is state
    assert control.stops == 3
    control.go(RunState.STOPPING)
    assert bench.manager.stop(run) is not None
    control.finish(RunState.STOPPED)
    assert bench.ended(run) is RunState.STOPPED
    assert bench.manager.stop(run) is None


def wait_for_stop(_: RunWorkspace, stop: threading.Event) -> bool:
    """A motion that is never ready."""
    assert stop.wait(20.0)
    return False


def test_stop_before_there_is_a_motion(bench: Bench) -> None:
    run = bench.submit(wait_for_stop)
    assert bench.state(run) is RunState.CREATED
    bench.manager.stop(run)
    assert bench.ended(run) is RunState.STOPPED
    assert bench.controls.started == []
    assert bench.told(run) == ["stopped"]


def test_stop_while_the_control_process_is_being_started(bench: Bench) -> None:
    starting, go_on = threading.Event(), threading.Event()
    start = bench.controls.__call__

    def slowly(workspace: RunWorkspace, report: object) -> object:
        starting.set()
        assert go_on.wait(20.0)
        return start(workspace, report)  # type: ignore[arg-type]

    bench.manager._start = slowly  # type: ignore[assignment]
    run = bench.submit()
    assert starting.wait(20.0)
    bench.manager.stop(run)
    go_on.set()
    control = bench.controls.next()
    assert control.when_stopped()
    control.finish(RunState.STOPPED)
    assert bench.ended(run) is RunState.STOPPED


def test_stop_needs_no_lock_of_the_desk_nor_of_the_claims(bench: Bench) -> None:
    run = bench.submit()
    control = bench.controls.next()
    done = threading.Event()

    def stop() -> None:
        bench.manager.stop(run)
        done.set()

    with bench.manager._lock, bench.manager._registering, bench.claims._lock:
        threading.Thread(target=stop).start()
        assert done.wait(20.0)
        assert control.stops == 1
    control.finish(RunState.STOPPED)
    bench.ended(run)


@pytest.mark.parametrize(
    ("failure", "code", "detail"),
    [
        (AcquisitionError("no such backend"), "acquisition", "no such backend"),
        (StepFailedError(JobProblem(code="excitation", detail="no room")), "excitation", "no room"),
        (ZeroDivisionError("a bug"), "internal", "a fault of Tauscope's own"),
    ],
)
@pytest.mark.parametrize("place", ["motion", "start"])
def test_what_keeps_a_run_from_beginning(place: str, failure: Exception, code: str, detail: str, bench: Bench) -> None:
    def fail(*_: object) -> bool:
        raise failure

    if place == "start":
        bench.controls.refusal = failure
    run = bench.submit(fail if place == "motion" else ready_motion)
    assert bench.ended(run) is RunState.FAILED
    problem = bench.workspace(run).problem()
    assert problem is not None
    assert problem.code == code
    assert detail in problem.detail
    following = bench.submit(wait_for_stop)  # the arm is free again
    bench.manager.stop(following)
    bench.ended(following)


def test_a_problem_says_nothing_of_the_servers_folders(bench: Bench) -> None:
    run = bench.submit()
    control = bench.controls.next()
    detail = f"{bench.workspace(run).robot}/arm.yaml: and {control.folder}/journal.mcap"
    control.finish(RunState.FAILED, RunProblem(code="acquisition", detail=detail))
    bench.ended(run)
    problem = bench.workspace(run).problem()
    assert problem is not None
    assert problem.detail == "arm.yaml: and journal.mcap"
    last = bench.workspace(run).events.last()
    assert last is not None
    assert last["problem"]["detail"] == problem.detail


def test_the_control_process_hears_of_its_owner_only_while_requests_are_answered(bench: Bench) -> None:
    bench.alive = False
    run = bench.submit()
    control = bench.controls.next()
    control.go(RunState.RUNNING)
    assert control.beats == 0
    bench.alive = True
    wait_until(lambda: control.beats > 2)
    control.finish()
    bench.ended(run)


def test_a_run_that_was_stopped_keeps_what_was_recorded(bench: Bench) -> None:
    run = bench.submit()
    bench.controls.next().finish(RunState.STOPPED)
    bench.ended(run)
    assert bench.recordings.holds(run_recording_name(run))


def test_a_run_that_never_moved_leaves_no_recording(bench: Bench) -> None:
    run = bench.submit()
    bench.controls.next().finish(RunState.FAILED, RunProblem(code="acquisition", detail="taken"), csv="")
    bench.ended(run)
    assert not bench.recordings.holds(run_recording_name(run))


@pytest.mark.parametrize("then", ["there is room again", "restart"])
def test_a_recording_that_a_full_disk_did_not_take_is_kept_afterwards(
    then: str, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("tauscope.server.store.recordings.write_atomically", full)
        run = bench.submit()
        bench.controls.next().finish()
        assert bench.ended(run) is RunState.FINISHED
        assert not bench.recordings.holds(run_recording_name(run))
        with pytest.raises(OSError, match="No space"):
            bench.manager.settle()
    if then == "restart":
        bench.open()
    else:
        bench.manager.settle()
    assert bench.recordings.path(run_recording_name(run)).read_text(encoding="utf-8") == CSV
    assert bench.told(run)[-1] == "finished"


def test_removing(bench: Bench) -> None:
    run = bench.submit()
    control = bench.controls.next()
    assert not bench.manager.remove(run)
    control.finish()
    bench.ended(run)
    assert bench.manager.remove(run)
    assert bench.recordings.holds(run_recording_name(run))
    with pytest.raises(NotFoundError):
        bench.manager.remove(run)


def test_closing_stops_every_run_and_takes_no_further_one(bench: Bench) -> None:
    runs = [bench.submit(device=device) for device in ("one", "two")]

    controls = [bench.controls.next(number) for number in (1, 2)]

    def obey() -> None:
        for control in controls:
            assert control.when_stopped()
            control.finish(RunState.STOPPED)

    thread = threading.Thread(target=obey)
    thread.start()
    bench.manager.close()
    thread.join(20.0)
    assert [bench.state(run) for run in runs] == [RunState.STOPPED, RunState.STOPPED]
    with pytest.raises(BusyError, match="the service is ending"):
        bench.submit(device="three")


def test_a_run_of_an_earlier_service_that_never_began_is_interrupted(bench: Bench) -> None:
    run = bench.submit(wait_for_stop)
    later = bench.open()
    assert bench.state(run) is RunState.INTERRUPTED
    assert later.live(run) is None
    assert bench.told(run)[-1] == "interrupted"
    bench.manager.stop(run)


@pytest.mark.parametrize("loss", ["the end was not told", "the recording was not kept"])
def test_what_an_earlier_service_left_undone_is_done_by_the_next(loss: str, bench: Bench) -> None:
    run = bench.submit()
    bench.controls.next().finish()
    bench.ended(run)
    log = bench.workspace(run).events.path
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:-1]))
    if loss == "the recording was not kept":
        bench.recordings.remove(run_recording_name(run))
    for _ in range(2):
        bench.open()
    assert bench.told(run).count("finished") == 1
    assert bench.recordings.holds(run_recording_name(run))


@pytest.mark.parametrize("damage", [b"", b"\0\1", b"{}", b"[" * 10_000])
def test_a_damaged_run_does_not_keep_the_service_from_starting(damage: bytes, bench: Bench) -> None:
    run = bench.submit()
    bench.controls.next().finish()
    bench.ended(run)
    (bench.workspace(run).control / "run.json").write_bytes(damage)
    assert bench.open().remove(run)
