"""Campaigns: every step in its turn, stopped at once, and after a restart only analysis goes on."""

import shutil
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from server.queue.controls import HandControls, finish_at_once
from server.queue.executors import InlineExecutor, ManualExecutor
from server.queue.waiting import wait_until
from tauscope.runtime.record import RunProblem
from tauscope.runtime.states import RunState
from tauscope.server.control import campaign as campaign_runner
from tauscope.server.control.campaign import (
    CampaignDependencies,
    CampaignLinks,
    CampaignManager,
    CampaignOrder,
    CampaignWorkspace,
)
from tauscope.server.control.leases import BusyError, DeviceClaims
from tauscope.server.control.run import RunWorkspace
from tauscope.server.control.run_manager import RunManager, StartControl
from tauscope.server.queue.analyses import DiagnosisWorkspace, ExcitationWorkspace, IdentificationWorkspace
from tauscope.server.queue.job_folder import JobProblem, JobRecord, JobState, Workspace
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.store.data_folder import ItemStore
from tauscope.server.store.recordings import RecordingStore
from tauscope.tasks.campaign import HeldOutMotion
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.run import BackendChoice


def design(folder: Path) -> None:
    ExcitationWorkspace(folder).trajectory.write_text("{}", encoding="utf-8")


def identify(_: Path) -> None:
    return None


def diagnose(_: Path) -> None:
    return None


def no_room(_: Path) -> JobProblem:
    return JobProblem(code="excitation", detail="joint2: no room")


class Bench:
    """Everything that a campaign needs, with doubles for the work and the arm."""

    def __init__(
        self,
        folder: Path,
        start: StartControl = finish_at_once,
        executor: ManualExecutor | None = None,
        design: Callable[[Path], JobProblem | None] = design,
    ) -> None:
        self.folder = folder
        self.recordings = RecordingStore(folder / "recordings")
        self.excitations = JobKind(ItemStore(folder / "excitations", "excitation"), design)
        self.identifications = JobKind(ItemStore(folder / "identifications", "identification"), identify)
        self.diagnoses = JobKind(ItemStore(folder / "diagnoses", "diagnosis"), diagnose)
        kinds = [self.excitations, self.identifications, self.diagnoses]
        self.jobs = JobQueue(kinds, executor or InlineExecutor(), slots=1, most_waiting=9)
        self.claims = DeviceClaims(4)
        items = ItemStore(folder / "runs", "run")
        self.runs = RunManager(items, self.recordings, start, self.claims, lambda: True)
        by_noun = {kind.items.noun: kind for kind in kinds}
        dependencies = CampaignDependencies(self.jobs, by_noun, self.runs, self.recordings)
        self.manager = CampaignManager(ItemStore(folder / "campaigns", "campaign"), dependencies)

    def submit(self, **changes: object) -> str:
        staged = self.manager.items.stage()
        workspace = CampaignWorkspace(staged)
        workspace.prepare()
        (workspace.robot / "arm.yaml").write_text("name: arm\n", encoding="utf-8")
        order = CampaignOrder(robot_file="arm.yaml", robot_name="arm", backend=BackendChoice(name="sim"))
        workspace.write_order(order.model_copy(update=changes))
        try:
            return self.manager.submit(staged)
        finally:
            self.manager.items.discard(staged)

    def workspace(self, campaign: str) -> CampaignWorkspace:
        return CampaignWorkspace(self.manager.items.folder(campaign))

    def record(self, campaign: str) -> JobRecord:
        record = self.workspace(campaign).read_record()
        assert record is not None
        return record

    def ended(self, campaign: str) -> JobRecord:
        wait_until(lambda: self.manager.find(campaign) is None)
        return self.record(campaign)

    def steps(self, campaign: str) -> list[str]:
        events = self.workspace(campaign).events.follow().read()
        return [event.content["step"] for event in events if event.content["kind"] == "step"]


ALL_STEPS = [
    "design the motion",
    "run the motion",
    "design the held-out motion",
    "run the held-out motion",
    "identify",
]


def test_a_campaign_from_its_beginning_to_its_end(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    scenario = {"torque_noise_std": [0.5], "seed": 7}
    campaign = bench.submit(
        excitation=ExcitationDesignOptions(seed=3, periods=4),
        backend=BackendChoice(name="sim", scenario=scenario),
        held_out=HeldOutMotion(periods=2),
    )
    assert bench.ended(campaign).state is JobState.SUCCEEDED
    assert bench.steps(campaign) == ALL_STEPS
    made = bench.workspace(campaign).read_made()
    orders = [
        ExcitationWorkspace(bench.excitations.items.folder(identifier or "")).read_order()
        for identifier in (made.excitation, made.held_out_excitation)
    ]
    options = [order.options for order in orders if order is not None]
    assert [(entry.seed, entry.periods, entry.slow_postures) for entry in options] == [(3, 4, 3), (4, 2, 0)]
    requests = [RunWorkspace(bench.runs.items.folder(run or "")).read_order() for run in (made.run, made.held_out_run)]
    assert [request and request.excitation for request in requests] == [made.excitation, made.held_out_excitation]
    assert [request and request.campaign for request in requests] == [campaign, campaign]
    # The sensors' noise is another one in each run, also where the scenario's seed is fixed.
    assert [request and (request.backend.scenario or {})["seed"] for request in requests] == [7, 8]
    order = IdentificationWorkspace(bench.identifications.items.folder(made.identification or "")).read_order()
    assert order is not None
    assert [entry.name for entry in order.recordings] == [f"run-{made.run}.csv"]
    assert [entry.name for entry in order.held_out] == [f"run-{made.held_out_run}.csv"]
    assert (made.recordings, made.held_out) == ((f"run-{made.run}.csv",), (f"run-{made.held_out_run}.csv",))


def test_a_full_disk_delays_a_campaigns_end_and_not_the_arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign_runner, "RETRY_S", 0.01)
    is_full, was_refused = threading.Event(), threading.Event()
    is_full.set()
    write = CampaignWorkspace.write_record

    def on_a_full_disk(workspace: CampaignWorkspace, record: JobRecord) -> None:
        if record.state.is_end and is_full.is_set():
            was_refused.set()
            raise OSError(28, "No space left on device")
        write(workspace, record)

    monkeypatch.setattr(CampaignWorkspace, "write_record", on_a_full_disk)
    bench = Bench(tmp_path)
    campaign = bench.submit()
    assert was_refused.wait(60.0)
    assert bench.record(campaign).state is JobState.RUNNING
    bench.claims.require_free(BackendChoice(name="sim").device("arm"))
    is_full.clear()
    assert bench.ended(campaign).state is JobState.SUCCEEDED


def test_a_campaign_that_ends_with_a_diagnosis_of_the_same_recordings(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    campaign = bench.submit(diagnosis=DiagnosisOptions(against="model"))
    assert bench.ended(campaign).state is JobState.SUCCEEDED
    assert bench.steps(campaign) == [*ALL_STEPS, "diagnose"]
    made = bench.workspace(campaign).read_made()
    order = DiagnosisWorkspace(bench.diagnoses.items.folder(made.diagnosis or "")).read_order()
    assert order is not None
    assert order.options.against == "model"
    assert [entry.name for entry in order.recordings] == list(made.recordings)
    assert [entry.name for entry in order.held_out] == list(made.held_out)


def test_a_campaign_without_a_held_out_motion(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    campaign = bench.submit(held_out=None)
    assert bench.ended(campaign).state is JobState.SUCCEEDED
    assert bench.steps(campaign) == ["design the motion", "run the motion", "identify"]
    assert bench.workspace(campaign).read_made().held_out == ()


def test_the_progress_of_a_run_is_told(tmp_path: Path) -> None:
    controls = HandControls()
    bench = Bench(tmp_path, controls)
    campaign = bench.submit(held_out=None)
    control = controls.next()
    control.go(RunState.RUNNING)
    control.progress(33.0)

    def is_told() -> bool:
        last = bench.workspace(campaign).events.last()
        return last is not None and last.get("percent") == 33.0

    wait_until(is_told)
    control.finish()
    bench.ended(campaign)


def test_a_campaign_has_the_arm_until_its_motions_are_done(tmp_path: Path) -> None:
    controls, executor = HandControls(), ManualExecutor()
    bench = Bench(tmp_path, controls, executor)
    campaign = bench.submit()
    with pytest.raises(BusyError, match=f"arm on sim: campaign {campaign} has it"):
        bench.submit()
    for _ in range(2):
        wait_until(lambda: bool(executor.tasks))
        executor.run()  # the designs
    for number in (1, 2):
        with pytest.raises(BusyError):
            bench.submit()
        controls.next(number).finish(csv=f"# {number}\n")
    wait_until(lambda: bool(executor.tasks))  # the identification waits: nothing moves any more
    bench.claims.take("arm on sim", "somebody")
    executor.run()
    assert bench.ended(campaign).state is JobState.SUCCEEDED


def test_the_problem_of_a_step_is_the_campaigns(tmp_path: Path) -> None:
    bench = Bench(tmp_path, design=no_room)
    problem = bench.ended(bench.submit()).problem
    assert problem is not None
    assert problem.code == "excitation"
    assert problem.detail.endswith(": joint2: no room")
    bench.claims.take("arm on sim", "somebody")  # the arm is free again


@pytest.mark.parametrize(
    ("state", "problem", "words"),
    [
        (RunState.FAILED, RunProblem(code="acquisition", detail="joint1: too fast"), "joint1: too fast"),
        (RunState.STOPPED, None, "was stopped"),
    ],
)
def test_a_run_that_does_not_finish_ends_the_campaign(
    state: RunState, problem: RunProblem | None, words: str, tmp_path: Path
) -> None:
    controls = HandControls()
    bench = Bench(tmp_path, controls)
    campaign = bench.submit()
    controls.next().finish(state, problem)
    record = bench.ended(campaign)
    assert (record.state, record.problem and record.problem.code) == (JobState.FAILED, "acquisition")
    assert words in str(record.problem)
    assert len(controls.started) == 1


def test_stop_while_the_motion_is_designed(tmp_path: Path) -> None:
    executor = ManualExecutor()
    bench = Bench(tmp_path, executor=executor)
    campaign = bench.submit()
    wait_until(lambda: bench.workspace(campaign).read_made().held_out_excitation is not None)
    assert bench.manager.stop(campaign)
    assert bench.ended(campaign).state is JobState.CANCELLED
    made = bench.workspace(campaign).read_made()
    for identifier in (made.excitation, made.held_out_excitation):
        record = Workspace(bench.excitations.items.folder(identifier or "")).read_record()
        assert record is not None
        assert record.state is JobState.CANCELLED
    assert not bench.manager.stop(campaign)


def test_stop_while_the_arm_moves_stops_the_arm_at_once(tmp_path: Path) -> None:
    controls = HandControls()
    bench = Bench(tmp_path, controls)
    campaign = bench.submit()
    control = controls.next()
    control.go(RunState.RUNNING)
    wait_until(lambda: bench.workspace(campaign).read_made().run is not None)
    done = threading.Event()

    def stop() -> None:
        bench.manager.stop(campaign)
        done.set()

    with bench.jobs._lock, bench.manager._lock, bench.manager._registering, bench.runs._lock, bench.claims._lock:
        threading.Thread(target=stop).start()
        assert done.wait(20.0)
        assert control.stops == 1
    control.finish(RunState.STOPPED)
    assert bench.ended(campaign).state is JobState.CANCELLED


@pytest.mark.parametrize("is_closed", [True, False])
def test_what_was_measured_before_a_restart_is_analysed_after_it(is_closed: bool, tmp_path: Path) -> None:
    executor, controls = ManualExecutor(), HandControls()
    earlier = Bench(tmp_path, finish_at_once, executor)
    campaign = earlier.submit(held_out=None)
    for _ in range(2):  # the design, and then the identification, which never begins
        wait_until(lambda: bool(executor.tasks))
        if not earlier.workspace(campaign).read_made().recordings:
            executor.run()
    wait_until(lambda: earlier.workspace(campaign).read_made().identification is not None)
    if is_closed:
        earlier.manager.begin_close()
        earlier.manager.close()
        earlier.jobs.close()
    assert earlier.record(campaign).state is JobState.RUNNING
    first = earlier.workspace(campaign).read_made().identification
    later = Bench(tmp_path, controls)
    assert later.ended(campaign).state is JobState.SUCCEEDED
    assert later.workspace(campaign).read_made().identification == first  # the same job, gone on with: not a second one
    assert controls.started == []
    earlier.manager.close()


@pytest.mark.parametrize("is_closed", [True, False])
def test_what_was_not_measured_before_a_restart_never_moves_by_itself(is_closed: bool, tmp_path: Path) -> None:
    executor, controls = ManualExecutor(), HandControls()
    earlier = Bench(tmp_path / "earlier", controls, executor)
    campaign = earlier.submit()
    wait_until(lambda: earlier.workspace(campaign).read_made().held_out_excitation is not None)
    if is_closed:
        earlier.manager.close()
    shutil.copytree(tmp_path / "earlier", tmp_path / "later")  # a service that is dead does not go on with its own
    later = Bench(tmp_path / "later", controls)
    assert later.ended(campaign).state is JobState.INTERRUPTED
    assert controls.started == []
    events = later.workspace(campaign).events.last()
    assert events is not None
    assert events["kind"] == "ended"
    earlier.manager.close()


def test_removing(tmp_path: Path) -> None:
    executor = ManualExecutor()
    bench = Bench(tmp_path, executor=executor)
    campaign = bench.submit()
    assert not bench.manager.remove(campaign)
    bench.manager.stop(campaign)
    bench.ended(campaign)
    assert bench.manager.remove(campaign)
    assert bench.manager.items.identifiers() == []


def test_a_damaged_record_of_what_was_made_is_nothing(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    campaign = bench.submit(held_out=None)
    bench.ended(campaign)
    (bench.workspace(campaign).folder / "made.json").write_bytes(b"\0")
    assert bench.workspace(campaign).read_made() == CampaignLinks()
