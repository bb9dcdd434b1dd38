"""A run from its owner's side: the control process, its events, and every way to stop it."""

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
from tauscope.robot import Robot
from tauscope.runtime.in_process import prepare_folder
from tauscope.runtime.options import RunOrder, write_order
from tauscope.runtime.processes import child_environment
from tauscope.runtime.progress import Report
from tauscope.runtime.record import LOG_FILE, STOP_FILE, RunRecord, new_record, read_record, write_process, write_record
from tauscope.runtime.recovery import recover_run
from tauscope.runtime.stop_listener import BEAT, STOP

BEATS_A_HEARTBEAT = 5
"""How often an owner says that it is alive in the time after which it counts as gone."""

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
            write_record(folder, new_record(robot.name, order.backend.name, order.options.mode.value))
            with (folder / LOG_FILE).open("ab") as log:
                self._process = subprocess.Popen(  # noqa: S603 - our own program
                    [*program, str(folder)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=log,
                    env=child_environment(),
                    bufsize=0,
                )
            write_process(folder, self._process.pid)
        except OSError as error:
            raise AcquisitionError(f"{folder}: the run cannot be started ({error.strerror or error})") from error
        assert self._process.stdin is not None  # noqa: S101 - asked for above
        assert self._process.stdout is not None  # noqa: S101
        self._commands, self._events = self._process.stdin, self._process.stdout
        os.set_blocking(self._commands.fileno(), False)
        self._record: RunRecord | None = None
        self._problem: AcquisitionError | None = None
        self._has_ended, self._stop_asked = threading.Event(), threading.Event()
        self._watcher = threading.Thread(target=self._watch, name=f"run {folder.name}", daemon=True)
        self._watcher.start()

    @property
    def pid(self) -> int:
        """Number of the control process."""
        return self._process.pid

    @property
    def has_ended(self) -> bool:
        """Whether the process has ended and its record is final."""
        return self._has_ended.is_set()

    def beat(self) -> None:
        """Say that the owner is alive."""
        self._send(BEAT)

    def stop(self) -> None:
        """Ask the run to stop, in every way at once; returns at once, and may be called at any time and again."""
        self._stop_asked.set()
        self._send(STOP)
        with suppress(OSError):  # it has ended
            self._process.send_signal(signal.SIGTERM)
        # Last and elsewhere: a disk that is stuck must not hold up the ways before, nor the caller.
        threading.Thread(target=self._put_stop_file, name="stop-file", daemon=True).start()

    def wait(self, timeout_s: float | None = None) -> RunRecord:
        """Wait for the end of the run.

        Raises TimeoutError where it has not ended by then. Raises AcquisitionError where its record cannot be read or
        written.

        `timeout_s`: how long; for good where None [s].
        """
        if not self._has_ended.wait(timeout_s):
            raise TimeoutError(f"{self.folder}: the run has not ended within {timeout_s:g} s")
        if self._problem is not None:
            raise self._problem
        assert self._record is not None  # noqa: S101 - one of the two was set before the event
        return self._record

    def _put_stop_file(self) -> None:
        try:
            (self.folder / STOP_FILE).touch()
        except OSError:
            return

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
            self._record = ended or read_record(self.folder)
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
