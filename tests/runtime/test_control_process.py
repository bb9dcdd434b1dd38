"""The control process over a double: its life, and every way to stop it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from runtime.control_runs import Events, start, state_of, states, wait_for, write_order
from tauscope.recording import read_recording
from tauscope.recording.journal_reading import read_journal
from tauscope.runtime.record import ProcessName, read_record
from tauscope.runtime.run_process import RunProcess
from tauscope.runtime.states import RunState
from tauscope.runtime.stop_listener import STOPPING_S


def packages_of(module: str) -> set[str]:
    """Every package that a new interpreter has loaded once it has imported a module."""
    listed = f"import sys, {module}; print(*{{name.partition('.')[0] for name in sys.modules}})"
    return set(
        subprocess.run([sys.executable, "-c", listed], capture_output=True, text=True, check=True).stdout.split()
    )


def test_it_begins_without_what_only_analysis_needs() -> None:
    loaded = packages_of("tauscope.runtime.control")
    assert "numpy" in loaded
    assert not {"scipy", "matplotlib", "sqlalchemy", "fastapi", "mujoco"} & loaded


def test_a_simulated_arm_begins_without_a_window_system() -> None:
    loaded = packages_of("tauscope_sim.driver")
    assert "mujoco" in loaded
    assert not {"glfw", "OpenGL"} & loaded


def test_a_run_in_real_time(tmp_path: Path) -> None:
    run, events = start(tmp_path / "run", duration_s=1.0, watchdog_s=0.5)
    record = run.wait(60)
    assert record.problem is None, (tmp_path / "run" / "control.log").read_text()
    assert states(record) == ["created", "connecting", "enabling", "ramping", "running", "stopping", "finished"]
    assert events.states() == states(record)[1:]
    assert events[-1]["event"] == "end"
    assert any(event["event"] == "progress" for event in events)
    timing = record.timing
    assert timing is not None
    assert timing.cycles + timing.missed_periods == round(500 * ((record.ramp_s or 0) + (record.motion_s or 0)))
    assert set(timing.lateness_us) == {"p50", "p99", "p99.9", "max"}
    assert record.real_time is not None
    assert record.real_time.scheduler.startswith(("fifo", "ordinary"))
    assert record.recording is not None
    assert record.recording.lost_rows == 0
    assert not record.recording.partial
    journal = read_journal(tmp_path / "run" / "journal.mcap")
    assert len(journal.rows) == timing.cycles
    assert len(read_recording(tmp_path / "run" / "recording.csv")) == record.recording.samples


@pytest.mark.slow
def test_a_run_in_virtual_time(tmp_path: Path) -> None:
    run, _ = start(tmp_path / "run", duration_s=4.0, settings={"virtual": True})
    record = run.wait(60)
    assert record.state is RunState.FINISHED
    assert record.timing is not None
    assert record.timing.missed_periods == 0
    assert record.real_time is not None
    assert not record.real_time.memory_locked


def by_pipe(run: RunProcess) -> None:
    run._send(b"s")


def by_file(run: RunProcess) -> None:
    (run.folder / "stop").touch()


def by_sigterm(run: RunProcess) -> None:
    os.kill(run.pid, signal.SIGTERM)


def by_sigint(run: RunProcess) -> None:
    os.kill(run.pid, signal.SIGINT)


WAYS = [by_pipe, by_file, by_sigterm, by_sigint]
QUICK_BY_PIPE = [by_pipe, *(pytest.param(way, marks=pytest.mark.slow) for way in WAYS[1:])]
QUICK_BY_FILE = [by_file, *(pytest.param(way, marks=pytest.mark.slow) for way in (by_pipe, by_sigterm, by_sigint))]


@pytest.mark.parametrize("way", QUICK_BY_PIPE)
def test_each_way_to_stop_a_running_arm(tmp_path: Path, way: object) -> None:
    run, events = start(tmp_path / "run", duration_s=60.0, watchdog_s=0.5)
    wait_for(lambda: "running" in events.states(), "the motion")
    wait_for(lambda: _percent(events) > 2.5, "a good part of a second of motion")
    way(run)  # type: ignore[operator]
    record = run.wait(20)
    assert states(record)[-2:] == ["stopping", "stopped"]
    assert record.stop
    assert record.recording is not None
    assert record.recording.partial
    assert record.recording.files


@pytest.mark.parametrize("way", QUICK_BY_FILE)
@pytest.mark.parametrize(
    "call", [*(pytest.param(call, marks=pytest.mark.slow) for call in ("connect", "enable")), "exchange"]
)
def test_a_stop_while_the_backend_does_not_return(tmp_path: Path, way: object, call: str) -> None:
    last = {"connect": "connecting", "enable": "enabling", "exchange": "ramping"}[call]
    run, events = start(tmp_path / "run", settings={"block": call}, watchdog_s=0.5)
    wait_for(lambda: last in events.states(), f"the state {last}")
    way(run)  # type: ignore[operator]
    record = run.wait(20)
    assert states(record)[-3:] == [last, "stopping", "stopped"]


@pytest.mark.slow
def test_a_stop_that_the_drives_do_not_confirm(tmp_path: Path) -> None:
    run, events = start(tmp_path / "run", duration_s=60.0, settings={"block": "stop"}, watchdog_s=0.5)
    wait_for(lambda: "ramping" in events.states(), "the ramp")
    run.stop()
    run.stop()
    record = run.wait(20)
    assert record.state is RunState.STOPPED
    assert record.problem is not None
    assert "did not confirm" in record.problem.detail


def test_a_stop_while_the_journals_disk_is_stuck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STUCK_DISK", "1")
    run, events = start(tmp_path / "run", duration_s=60.0, watchdog_s=0.5)
    lost = lambda: any(event.get("lost_rows", 0) > 0 for event in events)  # noqa: E731
    wait_for(lost, "a full queue")
    assert "running" in events.states(), "the loop goes on"
    run.stop()
    record = run.wait(20)
    assert record.state is RunState.STOPPED
    assert record.recording is not None
    assert record.recording.lost_rows > 0
    assert record.recording.files == ()
    assert any("does not take it" in remark for remark in record.recording.remarks)


def test_an_owner_that_stops_talking_interrupts_its_run(tmp_path: Path) -> None:
    run, events = start(tmp_path / "run", duration_s=60.0, watchdog_s=0.5, heartbeat_s=2.0)
    wait_for(lambda: "running" in events.states(), "the motion")
    wait_for(lambda: _percent(events) > 2.5, "a good part of a second of motion")
    run._beats_by_itself = False
    record = run.wait(20)
    assert states(record)[-2:] == ["stopping", "interrupted"]
    assert record.stop is not None
    assert "silent for 2 s" in record.stop
    assert record.recording is not None
    assert record.recording.partial


def test_an_owner_may_be_silent_in_virtual_time(tmp_path: Path) -> None:
    settings = {"virtual": True, "slow": {"connect": 0.5, "enable": 0.5, "exchange": 0.001}}
    run, _ = start(tmp_path / "run", settings=settings, heartbeat_s=0.05)
    run._beats_by_itself = False
    record = run.wait(60)
    assert (record.state, record.stop, record.problem) == (RunState.FINISHED, None, None)


def test_a_run_in_virtual_time_ends_with_its_owner(tmp_path: Path) -> None:
    settings = {"virtual": True, "slow": {"exchange": 0.01}}
    run, events = start(tmp_path / "run", duration_s=60.0, settings=settings)
    wait_for(lambda: "ramping" in events.states(), "the ramp")
    run._commands.close()
    record = run.wait(20)
    assert states(record)[-2:] == ["stopping", "interrupted"]
    assert record.stop == "the process that started it is gone"


@pytest.mark.slow
def test_a_simulated_arm_may_take_long_to_stop(tmp_path: Path) -> None:
    settings = {"virtual": True, "slow": {"exchange": 0.01, "stop": 1.5 * STOPPING_S}}
    run, events = start(tmp_path / "run", duration_s=60.0, settings=settings)
    wait_for(lambda: "ramping" in events.states(), "the ramp")
    run.stop()
    record = run.wait(20)
    assert (record.state, record.problem) == (RunState.STOPPED, None)


def test_a_backend_that_takes_the_process_down(tmp_path: Path) -> None:
    run, events = start(tmp_path / "run", settings={"crash": "exchange"})
    record = run.wait(30)
    assert states(record)[-1] == "interrupted", "after whichever state still reached the disk"
    assert record.problem is not None
    assert record.problem.code == "interrupted"
    assert read_record(run.folder) == record
    assert "ramping" in events.states()


@pytest.mark.slow
def test_a_process_killed_in_the_motion_leaves_a_readable_recording(tmp_path: Path) -> None:
    run, events = start(tmp_path / "run", duration_s=60.0, watchdog_s=0.5)
    wait_for(lambda: _percent(events) > 3.0, "some seconds of motion")
    os.kill(run.pid, signal.SIGKILL)
    record = run.wait(30)
    assert states(record)[-2:] == ["running", "interrupted"]
    assert record.recording is not None
    assert (record.recording.partial, record.recording.lost_rows) == (True, -1)
    assert record.recording.samples > 500
    assert len(read_recording(run.folder / "recording.csv")) == record.recording.samples
    assert read_journal(run.folder / "journal.mcap").damage is None, "its writer outlives it and closes the journal"


def _percent(events: Events) -> float:
    return max((event["percent"] for event in events if event["event"] == "progress"), default=0.0)


@pytest.mark.slow
def test_a_stop_while_the_process_is_still_being_loaded(tmp_path: Path) -> None:
    run, events = start(tmp_path / "run")
    run.stop()
    record = run.wait(60)
    assert states(record) == ["created", "stopping", "stopped"]
    assert record.problem is None
    assert events == []


def test_an_order_that_cannot_be_carried_out(tmp_path: Path) -> None:
    order = write_order(tmp_path / "run", settings={"virtual": True}).model_dump_json()
    for name, words in (("robot", "no such file"), ("trajectory", "no such file")):
        folder = tmp_path / name
        wrong = order.replace({"robot": "points.yaml", "trajectory": "run.json"}[name], "missing")
        run, events = _start_order(folder, wrong)
        record = run.wait(60)
        assert states(record) == ["created", "stopping", "failed"]
        assert record.problem is not None
        assert "missing" in record.problem.detail, words
        assert events[-1]["event"] == "end"


def _start_order(folder: Path, text: str) -> tuple[RunProcess, Events]:
    from runtime.control_runs import DOUBLE
    from runtime.doubles import point_robot
    from tauscope.runtime.options import RunOrder

    events = Events()
    order = RunOrder.model_validate_json(text)
    return RunProcess(folder, order, point_robot(), report=events, command=DOUBLE), events


def test_the_name_of_a_process() -> None:
    mine = ProcessName.of(os.getpid())
    assert mine.is_alive
    assert mine.start is not None
    assert not ProcessName(pid=mine.pid, start=mine.start + 1).is_alive, "another process of the same number"
    assert not ProcessName(pid=2**22 + 1, start=None).is_alive


@pytest.mark.slow
def test_state_on_disk_follows(tmp_path: Path) -> None:
    run, events = start(tmp_path / "run", duration_s=60.0, watchdog_s=0.5)
    wait_for(lambda: "running" in events.states(), "the motion")
    wait_for(lambda: state_of(run.folder) == "running", "the record on the disk")
    control = read_record(run.folder).control
    assert control is not None
    assert control.pid == run.pid
    run.stop()
    assert run.wait(20).state is RunState.STOPPED
