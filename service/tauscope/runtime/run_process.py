"""A run from its owner's side: the control process, every way to stop it, and what is done where it is gone."""

import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from tauscope.errors import AcquisitionError
from tauscope.recording.journal_process import wait_for_writer
from tauscope.robot import Robot
from tauscope.runtime import record as records
from tauscope.runtime.loop import Report
from tauscope.runtime.options import RunOrder, write_order
from tauscope.runtime.recorder import UNKNOWN_LOSS, save_recording
from tauscope.runtime.run import prepare_folder
from tauscope.runtime.states import RunState
from tauscope.runtime.stop_listener import BEAT, STOP

INTERRUPTED = "interrupted"  # code of the problem of a run whose process is gone
PATIENCE_S = 5.0  # time that a control process without an owner may take to stop its arm before it is ended
_WRITER_S = 10.0
_POLL_S = 0.02
_GONE = (
    "the process that moved the arm is gone: the device's watchdog has stopped the arm; look at it, then acknowledge "
    "the watchdog's fault and start again"
)
_NEVER_MOVED = (
    "the process that was to move the arm ended before the arm was under power: nothing has moved; "
    f"{records.LOG_FILE} in the run's folder may say why"
)
_WITHOUT_POWER = (RunState.CREATED, RunState.CONNECTING)


def recover_runs(folder: Path, *, patience_s: float = PATIENCE_S) -> tuple[records.RunRecord, ...]:
    """Interrupt runs without owner, after `patience_s` [s]; nothing moves. Raises AcquisitionError."""
    runs = sorted(path.parent for path in folder.glob(f"*/{records.RUN_FILE}"))
    recovered = (recover_run(run, patience_s=patience_s) for run in runs)
    return tuple(record for record in recovered if record is not None)


def recover_run(
    folder: Path, *, is_own: bool = False, was_asked_to_stop: bool = False, patience_s: float = PATIENCE_S
) -> records.RunRecord | None:
    """The new record of a run without owner, None where it goes on or has ended. Raises AcquisitionError."""
    record = records.read_record(folder)
    if record.state.is_end or (not is_own and record.owner is not None and record.owner.is_alive):
        return None
    # Also one that was frozen before it could hold the folder: it must not wake up to a run that is over.
    for control in (record.control, records.read_process(folder)):
        if control is not None:
            _see_to_its_end(control, patience_s)
    lock = records.wait_for_lock(folder, patience_s)
    if lock is None:
        raise AcquisitionError(f"{folder}: its control process does not end; restart the machine and look at the arm")
    try:
        # It may have come to its end in the meantime.
        record = records.read_record(folder)
        if record.state.is_end:
            return None
        if was_asked_to_stop and record.state is RunState.CREATED:
            return records.keep_record(folder, record.moved(RunState.STOPPING).moved(RunState.STOPPED))
        return _interrupt(folder, record)
    finally:
        lock.release()


def _see_to_its_end(control: records.ProcessName, patience_s: float) -> None:
    """Wait for a control process that has no owner any more, and end it where it is itself frozen or stuck."""
    deadline = time.monotonic() + patience_s
    while control.is_alive:
        if time.monotonic() >= deadline:
            os.kill(control.pid, signal.SIGKILL)
            return
        time.sleep(_POLL_S)


def _interrupt(folder: Path, record: records.RunRecord) -> records.RunRecord:
    recording = None
    journal = folder / records.JOURNAL_FILE
    if journal.exists():
        wait_for_writer(journal, _WRITER_S)
        recording = save_recording(folder, is_whole=False, lost_rows=UNKNOWN_LOSS)
    detail = _NEVER_MOVED if record.state in _WITHOUT_POWER and recording is None else _GONE
    problem = record.problem or records.RunProblem(code=INTERRUPTED, detail=detail)
    return records.keep_record(folder, record.moved(RunState.INTERRUPTED, problem=problem, recording=recording))


BEATS_A_HEARTBEAT = 5  # how often an owner says that it is alive in the time after which it counts as gone
_READ_BYTES = 2**16


class RunProcess:
    """A run in a process of its own, watched from a thread of this one."""

    def __init__(
        self,
        folder: Path,
        order: RunOrder,
        robot: Robot,
        *,
        report: Report | None = None,
        beats_by_itself: bool = True,
        command: Sequence[str] | None = None,
    ) -> None:
        """Start the process. Raises AcquisitionError where the folder holds a run or cannot be written to."""
        self.folder = folder
        self._report, self._beats_by_itself = report, beats_by_itself
        self._beat_s = order.options.heartbeat_s / BEATS_A_HEARTBEAT
        prepare_folder(folder)
        program = list(command or (sys.executable, "-m", "tauscope.runtime.control"))
        try:
            write_order(folder, order)
            records.write_record(folder, records.new_record(robot.name, order.backend.name, order.options.mode.value))
            with (folder / records.LOG_FILE).open("ab") as log:
                self._process = subprocess.Popen(  # noqa: S603 - our own program
                    [*program, str(folder)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=log,
                    env=records.child_environment(),
                    bufsize=0,
                )
            self.pid = self._process.pid
            records.write_process(folder, self.pid)
        except OSError as error:
            raise AcquisitionError(f"{folder}: the run cannot be started ({error.strerror or error})") from error
        assert self._process.stdin is not None  # noqa: S101 - asked for above
        assert self._process.stdout is not None  # noqa: S101
        self._commands, self._events = self._process.stdin, self._process.stdout
        os.set_blocking(self._commands.fileno(), False)
        self._record: records.RunRecord | None = None
        self._problem: AcquisitionError | None = None
        self._has_ended, self._stop_asked = threading.Event(), threading.Event()
        self._watcher = threading.Thread(target=self._watch, name=f"run {folder.name}", daemon=True)
        self._watcher.start()

    @property
    def has_ended(self) -> bool:
        """Whether the process has ended and its record is final."""
        return self._has_ended.is_set()

    def beat(self) -> None:
        self._send(BEAT)

    def stop(self) -> None:
        """Ask the run to stop, in every way at once; returns at once, and may be called at any time and again."""
        self._stop_asked.set()
        self._send(STOP)
        with suppress(OSError):  # it has ended
            self._process.send_signal(signal.SIGTERM)
        # Last and elsewhere: a disk that is stuck must not hold up the ways before, nor the caller.
        threading.Thread(target=self._put_stop_file, name="stop-file", daemon=True).start()

    def wait(self, timeout_s: float | None = None) -> records.RunRecord:
        """Wait for the end of the run [s]. Raises TimeoutError, or AcquisitionError where its record is lost."""
        if not self._has_ended.wait(timeout_s):
            raise TimeoutError(f"{self.folder}: the run has not ended within {timeout_s:g} s")
        if self._problem is not None:
            raise self._problem
        assert self._record is not None  # noqa: S101 - one of the two was set before the event
        return self._record

    def _put_stop_file(self) -> None:
        with suppress(OSError):
            (self.folder / records.STOP_FILE).touch()

    def _send(self, byte: bytes) -> None:
        """Write to the control process; a full pipe means that it is stopped itself, and its device stops the arm."""
        try:
            os.write(self._commands.fileno(), byte)
        except (OSError, ValueError):
            return

    def _watch(self) -> None:
        """Pass the events on and say that the owner is alive, until the process has ended; then settle its record."""
        poll = select.poll()
        poll.register(self._events, select.POLLIN | select.POLLHUP)
        pending, next_beat = b"", time.monotonic()
        while True:
            if self._beats_by_itself and time.monotonic() >= next_beat:
                self.beat()
                next_beat = time.monotonic() + self._beat_s
            if not poll.poll(1e3 * self._beat_s):
                continue
            data = os.read(self._events.fileno(), _READ_BYTES)
            if not data:
                break
            *lines, pending = (pending + data).split(b"\n")
            for line in lines:
                self._pass_on(line)
        self._process.wait()
        self._commands.close()
        self._events.close()
        try:
            was_asked_to_stop = self._stop_asked.is_set()
            ended = recover_run(self.folder, is_own=True, was_asked_to_stop=was_asked_to_stop)
            self._record = ended or records.read_record(self.folder)
        except AcquisitionError as error:
            self._problem = error
        self._has_ended.set()

    def _pass_on(self, line: bytes) -> None:
        if self._report is None:
            return
        try:
            event: Mapping[str, Any] = json.loads(line)
            self._report(event)
        except Exception as error:
            # Whatever the owner makes of it, the run goes on.
            sys.stderr.write(f"run {self.folder.name}: an event was not passed on ({error})\n")
