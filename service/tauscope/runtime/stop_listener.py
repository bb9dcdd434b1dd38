"""How a control process hears a request to stop: a byte on its pipe, a file in its folder, a signal, or silence.

Each way has a thread of its own or none, so that any of them works while the others are stuck. The loop looks at one
attribute. If a call into a driver or the disk does not return, a signal breaks the main thread out of it.

The arm's clock decides how long a run may wait. In real time the owner's silence ends the run, and the drives have a
limited time to confirm a stop. In virtual time the arm waits too, so a request or the end of the owner ends the run.
"""

import math
import os
import select
import signal
import threading
import time
from pathlib import Path
from types import FrameType

from tauscope.runtime.states import StopAskedError, StopRequest, StopSource

BEAT, STOP = b".", b"s"  # what an owner writes to its run's pipe: it is alive; the run has to stop
NOTICE_S = 0.25  # time for a run to notice a request before a signal breaks it out of its call
STOPPING_S = 2.0  # time for the drives to confirm the stop, in real time
_POLL_S = 0.02
_SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
_BREAK = signal.SIGUSR1


class StopListener:
    """Requests to stop a run in a process of its own; made and used in the main thread."""

    def __init__(self, command_pipe: int, stop_file: Path, heartbeat_s: float) -> None:
        self.requested: StopRequest | None = None
        self.is_real_time = False
        self._pipe, self._stop_file, self._heartbeat_s = command_pipe, stop_file, heartbeat_s
        self._asked_at: float | None = None
        self._acknowledged_at: float | None = None
        self._is_done = False
        self._main = threading.main_thread().ident
        for number in _SIGNALS:
            signal.signal(number, self._on_signal)
        signal.signal(_BREAK, self._on_break)
        threading.Thread(target=self._listen, name="stop-pipe", daemon=True).start()
        threading.Thread(target=self._watch_file, name="stop-file", daemon=True).start()

    def enter_real_time(self) -> None:
        self.is_real_time = True

    def acknowledge(self) -> None:
        """The run has begun to stop: it is broken out only if the stop itself takes too long."""
        self._acknowledged_at = time.monotonic()

    def done(self) -> None:
        """The arm is stopped, or nothing more can be done for it: nobody breaks into the run any more."""
        self._is_done = True

    def request(self, source: StopSource, detail: str) -> None:
        if self.requested is None:
            self.requested = StopRequest(source, detail)
            self._asked_at = time.monotonic()

    def _listen(self) -> None:
        """Hear the owner, or its silence; break the main thread out where it does not take notice."""
        poll = select.poll()
        poll.register(self._pipe, select.POLLIN | select.POLLHUP)
        heard = time.monotonic()
        is_open = True
        while not self._is_done:
            if not is_open:
                time.sleep(_POLL_S)
            elif poll.poll(_POLL_S * 1e3):
                data = os.read(self._pipe, 4096)
                heard, is_open = time.monotonic(), bool(data)
                if STOP in data:
                    self.request(StopSource.OPERATOR, "its owner asked it to stop")
                elif not is_open:
                    self.request(StopSource.OWNER_GONE, "the process that started it is gone")
            elif self.is_real_time and time.monotonic() - heard > self._heartbeat_s:
                silence = f"the process that started it has been silent for {self._heartbeat_s:g} s"
                self.request(StopSource.OWNER_GONE, silence)
            self._break_out_if_overdue()

    def _break_out_if_overdue(self) -> None:
        since, limit_s = self._asked_at, NOTICE_S
        if self._acknowledged_at is not None:
            since, limit_s = self._acknowledged_at, STOPPING_S if self.is_real_time else math.inf
        if since is None or self._main is None or self._is_done or time.monotonic() - since < limit_s:
            return
        if self._acknowledged_at is not None:
            self._acknowledged_at = time.monotonic()
        self._asked_at = time.monotonic()
        signal.pthread_kill(self._main, _BREAK)

    def _watch_file(self) -> None:
        """Look for the stop file; a disk that is stuck holds up this thread only."""
        while self.requested is None and not self._is_done:
            if self._stop_file.exists():
                self.request(StopSource.OPERATOR, f"the file {self._stop_file.name} was put into its folder")
            time.sleep(_POLL_S)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.request(StopSource.OPERATOR, f"it received {signal.Signals(number).name}")

    def _on_break(self, number: int, frame: FrameType | None) -> None:
        """Leave a call that does not return; runs in the main thread between two of its steps."""
        del number, frame
        if self._is_done or self.requested is None:
            return
        if self._acknowledged_at is not None:
            raise TimeoutError(f"no answer within {STOPPING_S:g} s")
        self.acknowledge()
        raise StopAskedError(self.requested)
