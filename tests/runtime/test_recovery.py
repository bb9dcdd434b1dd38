"""What the next start makes of runs whose process is gone, in whatever state they were left."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from runtime.doubles import PointArm, connection, point_robot, short_motion
from tauscope.errors import AcquisitionError
from tauscope.recording import read_recording
from tauscope.runtime.options import RunOrder, write_order
from tauscope.runtime.record import (
    ProcessName,
    RunLock,
    RunRecord,
    child_environment,
    read_record,
    write_process,
    write_record,
)
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.run_process import recover_runs
from tauscope.runtime.states import RunState, may_follow

GONE = ProcessName(pid=2**22 + 5, start=1)


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that came to its end."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    robot = point_robot()
    run_trajectory(robot, short_motion(robot), connection(PointArm(position=np.array([0.2, 0.1]))), folder)
    return folder


def left_behind(root: Path, ended: Path, state: RunState, name: str = "run", owner: ProcessName = GONE) -> Path:
    """A folder as a run leaves it whose process dies in a state; its journal was cut off by the crash."""
    folder = root / name
    folder.mkdir()
    record = read_record(ended).model_copy(
        update={"state": state, "owner": owner, "control": GONE, "recording": None, "problem": None}
    )
    write_record(folder, record)
    if state in (RunState.RUNNING, RunState.STOPPING):
        content = (ended / "journal.mcap").read_bytes()
        (folder / "journal.mcap").write_bytes(content[: len(content) * 2 // 3])
    return folder


@pytest.mark.parametrize("state", [state for state in RunState if not state.is_end])
def test_every_state_that_is_no_end_becomes_interrupted(tmp_path: Path, ended: Path, state: RunState) -> None:
    folder = left_behind(tmp_path, ended, state)
    (record,) = recover_runs(tmp_path)
    assert may_follow(state, record.state)
    assert record.state is RunState.INTERRUPTED
    assert read_record(folder) == record
    assert record.problem is not None
    never_moved = state in (RunState.CREATED, RunState.CONNECTING)
    assert ("nothing has moved" if never_moved else "watchdog") in record.problem.detail
    assert recover_runs(tmp_path) == (), "once is enough"


def test_the_journal_becomes_a_partial_recording(tmp_path: Path, ended: Path) -> None:
    folder = left_behind(tmp_path, ended, RunState.RUNNING)
    (record,) = recover_runs(tmp_path)
    assert record.recording is not None
    assert (record.recording.partial, record.recording.lost_rows) == (True, -1)
    assert any("truncated" in remark and "cycles came back" in remark for remark in record.recording.remarks)
    whole, part = read_recording(ended / "recording.csv"), read_recording(folder / "recording.csv")
    assert 100 < len(part) == record.recording.samples < len(whole)
    np.testing.assert_array_equal(part.samples().position, whole.samples(0, len(part)).position)
    np.testing.assert_array_equal(part.samples().effort, whole.samples(0, len(part)).effort)


@pytest.mark.parametrize("state", [state for state in RunState if state.is_end])
def test_a_run_that_has_ended_is_left_alone(tmp_path: Path, ended: Path, state: RunState) -> None:
    folder = left_behind(tmp_path, ended, state)
    before = (folder / "run.json").read_bytes()
    assert recover_runs(tmp_path) == ()
    assert (folder / "run.json").read_bytes() == before


def test_a_run_whose_owner_lives_is_left_to_its_owner(tmp_path: Path, ended: Path) -> None:

    folder = left_behind(tmp_path, ended, RunState.RUNNING, owner=ProcessName.of(os.getpid()))
    assert recover_runs(tmp_path) == ()
    assert read_record(folder).state is RunState.RUNNING


HOLDER = """
import sys, time
from pathlib import Path
from tauscope.runtime.record import RunLock
lock = RunLock(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(float(sys.argv[2]))
"""


def holder(folder: Path, seconds: float) -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-c", HOLDER, str(folder), str(seconds)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, env=child_environment())
    assert process.stdout is not None
    assert process.stdout.readline() == b"held\n"
    return process


def test_a_control_process_that_outlives_its_owner_is_waited_for_and_then_ended(tmp_path: Path, ended: Path) -> None:
    folder = left_behind(tmp_path, ended, RunState.RUNNING)
    with holder(folder, 600.0) as process:
        named = read_record(folder).model_copy(update={"control": ProcessName.of(process.pid)})
        write_record(folder, named)
        (record,) = recover_runs(tmp_path, patience_s=0.1)
        assert record.state is RunState.INTERRUPTED
        assert process.wait(10) == -9


def test_a_control_process_that_was_frozen_before_it_held_the_folder_is_ended(tmp_path: Path, ended: Path) -> None:
    folder = left_behind(tmp_path, ended, RunState.CREATED)
    with subprocess.Popen(["sleep", "600"]) as process:
        process.send_signal(signal.SIGSTOP)
        write_process(folder, process.pid)
        (record,) = recover_runs(tmp_path, patience_s=0.1)
        assert record.state is RunState.INTERRUPTED
        assert process.wait(10) == -9


def test_a_run_is_carried_out_once(ended: Path, capfd: pytest.CaptureFixture[str]) -> None:
    before = (ended / "run.json").read_bytes()
    write_order(ended, RunOrder(robot="arm.yaml", trajectory="motion.json"))
    program = [sys.executable, "-m", "tauscope.runtime.control", str(ended)]
    done = subprocess.run(program, env=child_environment(), stdin=subprocess.DEVNULL, check=False, timeout=60)
    assert done.returncode == 1
    assert "the run is finished already" in capfd.readouterr().err
    assert (ended / "run.json").read_bytes() == before


def test_only_the_process_of_that_name_is_ended(tmp_path: Path, ended: Path) -> None:
    """Its number may belong to somebody else by now."""
    folder = left_behind(tmp_path, ended, RunState.RUNNING)
    with holder(folder, 600.0) as process:
        start = ProcessName.of(process.pid).start
        assert start is not None
        namesake = ProcessName(pid=process.pid, start=start - 1)
        write_record(folder, read_record(folder).model_copy(update={"control": namesake}))
        with pytest.raises(AcquisitionError, match="does not end"):
            recover_runs(tmp_path, patience_s=0.05)
        assert process.poll() is None
        process.kill()


def test_several_runs_and_other_folders(tmp_path: Path, ended: Path) -> None:
    for name, state in (("a", RunState.RUNNING), ("b", RunState.FINISHED), ("c", RunState.CREATED)):
        left_behind(tmp_path, ended, state, name)
    (tmp_path / "notes").mkdir()
    (tmp_path / "readme.txt").write_text("not a run")
    assert [record.state for record in recover_runs(tmp_path)] == [RunState.INTERRUPTED] * 2


@pytest.mark.parametrize("content", [b"", b"{", b"[]", json.dumps({"form": "tauscope.run/9"}).encode(), b"\xff\xfe"])
def test_a_damaged_record_is_named_and_kept(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").write_bytes(content)
    with pytest.raises(AcquisitionError, match=r"run\.json: is not a run's record") as raised:
        recover_runs(tmp_path)
    assert "\n" not in str(raised.value)
    assert (tmp_path / "run" / "run.json").read_bytes() == content


def test_a_folder_has_one_holder(tmp_path: Path) -> None:
    lock = RunLock(tmp_path)
    with pytest.raises(AcquisitionError, match="another process carries this run out"):
        RunLock(tmp_path)
    lock.release()
    RunLock(tmp_path).release()


def test_a_record_reads_back_as_it_was_written(ended: Path, tmp_path: Path) -> None:
    record = read_record(ended)
    write_record(tmp_path, record)
    assert RunRecord.model_validate_json((tmp_path / "run.json").read_bytes()) == record
