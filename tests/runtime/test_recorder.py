"""The recorder: what is given to it is in the journal, or counted; it is never waited for."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from recording.test_journal import assert_equal_rows, header, rows
from runtime.control_runs import wait_for
from tauscope.errors import AcquisitionError
from tauscope.recording.journal_process import wait_for_writer
from tauscope.recording.journal_reading import read_journal
from tauscope.runtime import recorder as module
from tauscope.runtime.record import child_environment
from tauscope.runtime.recorder import DirectRecorder, RecorderProcess
from tauscope.runtime.run import open_recorder
from tauscope.runtime.states import ManualStop, StopAskedError

WRITER = f"exec {sys.executable} -m tauscope.recording.journal_process"


def give(recorder: RecorderProcess | DirectRecorder, table: np.ndarray) -> None:
    for k in range(len(table)):
        recorder.put(table[k : k + 1])


@pytest.mark.parametrize("kind", ["direct", "process"])
def test_everything_is_in_the_journal(tmp_path: Path, kind: str) -> None:
    path, table = tmp_path / "journal.mcap", rows(700)
    recorder = DirectRecorder(path, header()) if kind == "direct" else RecorderProcess(path, header())
    if isinstance(recorder, RecorderProcess):
        recorder.wait_until_open(ManualStop())
    give(recorder, table[:400])
    recorder.event(int(table["time_ns"][399]), {"event": "state", "state": "running"})
    give(recorder, table[400:])
    assert recorder.close() is None
    assert recorder.lost == 0
    journal = read_journal(path)
    assert journal.damage is None
    assert journal.events == ({"event": "state", "state": "running"},)
    assert_equal_rows(journal.rows, table)


def test_what_a_full_pipe_does_not_take_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The writer reads nothing before a file appears; what was taken and what was lost is all that was given."""
    monkeypatch.setattr(module, "PIPE_BYTES", 2**16)
    path, table, gate = tmp_path / "journal.mcap", rows(2000), tmp_path / "gate"
    slow = ("sh", "-c", f"while [ ! -e {gate} ]; do sleep 0.01; done; {WRITER} {path}")
    recorder = RecorderProcess(path, header(), command=slow)
    give(recorder, table)
    assert recorder.lost > 0
    gate.touch()
    recorder.wait_until_open(ManualStop())
    assert recorder.close() is None
    kept = read_journal(path).rows
    assert len(kept) + recorder.lost == len(table)
    assert_equal_rows(kept, table[: len(kept)])


def test_in_virtual_time_a_full_pipe_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PIPE_BYTES", 2**12)
    path, table = tmp_path / "journal.mcap", rows(2000)
    recorder = RecorderProcess(path, header(), may_wait=True)
    give(recorder, table)
    assert recorder.close() is None
    assert recorder.lost == 0
    assert_equal_rows(read_journal(path).rows, table)


def test_a_disk_that_is_full_ends_the_run(tmp_path: Path) -> None:
    path = tmp_path / "journal.mcap"
    recorder = RecorderProcess(path, header(), command=("sh", "-c", f"ulimit -f 32; {WRITER} {path}"))
    recorder.wait_until_open(ManualStop())
    table = rows(50)

    def has_ended() -> bool:
        try:
            give(recorder, table)
        except AcquisitionError as error:
            assert "is the disk full?" in str(error)  # noqa: PT017 - the condition of a wait
            return True
        return False

    wait_for(has_ended, "the writer's end")
    problem = recorder.close()
    assert problem is not None
    assert "cannot be written" in problem


@pytest.mark.parametrize("is_real_time", [False, True])
def test_a_journal_that_cannot_be_created(tmp_path: Path, is_real_time: bool) -> None:
    path = tmp_path / "journal.mcap"
    path.write_bytes(b"taken")
    with pytest.raises(AcquisitionError, match=r"cannot be created .*nothing has moved"):
        open_recorder(path, header(), ManualStop(), is_real_time)
    assert path.read_bytes() == b"taken"


def test_waiting_for_the_journal_can_be_broken_off(tmp_path: Path) -> None:
    stops = ManualStop()
    recorder = RecorderProcess(tmp_path / "journal.mcap", header(), command=("sh", "-c", "cat > /dev/null"))
    stops.request("changed my mind")
    with pytest.raises(StopAskedError, match="changed my mind"):
        recorder.wait_until_open(stops)
    assert recorder.close() == "the journal's writer ended before its time"


def test_what_is_in_the_pipe_outlives_whoever_put_it_there(tmp_path: Path) -> None:
    path = tmp_path / "journal.mcap"
    script = f"""
import os, signal
from pathlib import Path
from recording.test_journal import header, rows
from tauscope.runtime.recorder import RecorderProcess
from tauscope.runtime.states import ManualStop
recorder = RecorderProcess(Path({str(path)!r}), header())
recorder.wait_until_open(ManualStop())
table = rows(983)
for k in range(len(table)):
    recorder.put(table[k : k + 1])
os.kill(os.getpid(), signal.SIGKILL)
"""
    environment = child_environment()
    tests = str(Path(__file__).parents[1])
    environment["PYTHONPATH"] = f"{environment['PYTHONPATH']}:{tests}"
    killed = subprocess.run([sys.executable, "-c", script], env=environment, check=False, timeout=60)
    assert killed.returncode == -9
    assert wait_for_writer(path, 30.0)
    journal = read_journal(path)
    assert journal.damage is None
    assert_equal_rows(journal.rows, rows(983))
