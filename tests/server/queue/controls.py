"""Control processes that a test moves by hand."""

import threading
from collections.abc import Callable, Mapping
from typing import Any

from tauscope.runtime.record import RecordingFiles, RunProblem, RunRecord, new_record, write_record
from tauscope.runtime.states import RunState
from tauscope.server.control.run import RunWorkspace

WAY = (RunState.CONNECTING, RunState.ENABLING, RunState.RAMPING, RunState.RUNNING)
CSV = "t,q1,tau1\n" + "".join(f"{k},0.1,1.5\n" for k in range(20))


class HandControl:
    """Keeps a record as a control process does; the test says what happens."""

    def __init__(self, workspace: RunWorkspace, report: Callable[[Mapping[str, Any]], None]) -> None:
        self.folder, self._report = workspace.control, report
        self.folder.mkdir()
        request = workspace.read_order()
        self.record = new_record("arm" if request is None else request.robot_name, "sim", "position")
        write_record(self.folder, self.record)
        self.stops = self.beats = 0
        self.obeys = False
        self._has_ended = threading.Event()
        self._stop_asked = threading.Event()

    def stop(self) -> None:
        self.stops += 1
        self._stop_asked.set()
        if self.obeys and not self.record.state.is_end:
            self.finish(RunState.STOPPED)

    def beat(self) -> None:
        self.beats += 1

    def wait(self, timeout_s: float | None = None) -> RunRecord:
        if not self._has_ended.wait(timeout_s):
            raise TimeoutError
        return self.record

    def go(self, state: RunState, **changes: Any) -> None:
        """Enter a state, by way of those before it."""
        for step in WAY[: WAY.index(state) + 1] if state in WAY else (state,):
            if step not in {entry.state for entry in self.record.history}:
                self.record = self.record.moved(step, **changes)
                write_record(self.folder, self.record)
                at = self.record.history[-1].at.isoformat()
                self._report({"event": "state", "state": step.value, "at": at})

    def progress(self, percent: float) -> None:
        state = self.record.state.value
        self._report({"event": "progress", "state": state, "percent": percent, "missed_periods": 3})

    def finish(self, state: RunState = RunState.FINISHED, problem: RunProblem | None = None, csv: str = CSV) -> None:
        """End as a control process does, recording written."""
        if self.record.state is RunState.CREATED and state is RunState.FINISHED:
            self.go(RunState.RUNNING)
        self.go(RunState.STOPPING)
        if csv:
            (self.folder / "recording.csv").write_text(csv, encoding="utf-8")
            (self.folder / "journal.mcap").write_bytes(b"journal")
        files = RecordingFiles(
            samples=20, partial=state is not RunState.FINISHED, lost_rows=0, files=("recording.csv",)
        )
        self.go(state, problem=problem, recording=files if csv else None, played=1.0)
        self._has_ended.set()

    def vanish(self) -> None:
        """End without a word, as a process that was killed."""
        self._has_ended.set()

    def when_stopped(self) -> bool:
        """Whether it was asked to stop, within the test's patience."""
        return self._stop_asked.wait(20.0)


class HandControls:
    """Starts such control processes and hands them to the test, in their order."""

    def __init__(self) -> None:
        self.refusal: Exception | None = None
        self.started: list[HandControl] = []
        self.obey = False
        self._news = threading.Condition()

    def __call__(self, workspace: RunWorkspace, report: Callable[[Mapping[str, Any]], None]) -> HandControl:
        if self.refusal is not None:
            raise self.refusal
        control = HandControl(workspace, report)
        control.obeys = self.obey
        with self._news:
            self.started.append(control)
            self._news.notify_all()
        return control

    def obey_from_now_on(self) -> None:
        """Let every control process end as soon as it is asked to stop."""
        self.obey = True
        for control in self.started:
            control.obeys = True

    def next(self, number: int = 1) -> HandControl:
        """The control process of a number, once it was started."""
        with self._news:
            assert self._news.wait_for(lambda: len(self.started) >= number, timeout=20.0)
            return self.started[number - 1]


def finish_at_once(workspace: RunWorkspace, report: Callable[[Mapping[str, Any]], None]) -> HandControl:
    """A control process whose run is over before anybody looks."""
    control = HandControl(workspace, report)
    control.go(RunState.RUNNING)
    control.progress(50.0)
    # A recording of its own for every run: identifications refuse the same bytes twice.
    control.finish(csv=f"# {workspace.folder.name}\n{CSV}")
    return control
