"""Runs on their way: supervised threads, the manager that runs and campaigns share, and one supervisor a run."""

import logging
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from tauscope.errors import TauscopeError
from tauscope.runtime.loop import Report
from tauscope.runtime.record import RunProblem, RunRecord
from tauscope.runtime.states import RunState
from tauscope.server.control.leases import FREE, BusyError, DeviceClaims, Permit
from tauscope.server.control.run import Motion, RunWorkspace, StepFailedError
from tauscope.server.queue.job_folder import StateEvent
from tauscope.server.store.data_folder import ItemStore, staged_identifier
from tauscope.server.store.files import KeptFile, hash_file
from tauscope.server.store.recordings import RecordingStore

CLOSE_TIMEOUT_S = 15.0
"""How long a run or a campaign may take to stop when the service ends [s]. Its control process may last longer."""


class Supervisor(Protocol):
    @property
    def state(self) -> Any: ...

    def run(self) -> None: ...

    def stop(self) -> None:
        """Stop, in any state; takes no lock, returns at once, may be called repeatedly."""

    def interrupt(self) -> None: ...


S = TypeVar("S", bound=Supervisor)


class Manager(Generic[S]):
    """Active items, each with a thread, and the folders of all items. Every method may be called from any thread."""

    noun: ClassVar[str]

    def __init__(self, items: ItemStore) -> None:
        self.items = items
        self._lock, self._registering = threading.Lock(), threading.Lock()
        # Replaced as a whole, never changed: reading takes no lock, so that a stuck thread cannot delay a stop.
        self._active: Mapping[str, tuple[S, threading.Thread]] = {}
        self._is_closed = False
        items.tidy()

    def find(self, identifier: str) -> S | None:
        """The supervisor of an active item."""
        supervisor, _ = self._active.get(identifier, (None, None))
        return supervisor

    def remove(self, identifier: str) -> bool:
        """Remove an item that has ended, False where it is active. Raises NotFoundError if there is none."""
        if self.find(identifier) is not None:
            return False
        self.items.remove(identifier)
        return True

    def stop(self, identifier: str) -> Any:
        """Stop an item without any lock; returns the state in which it stood, None where it is not active."""
        supervisor = self.find(identifier)
        if supervisor is None:
            return None
        state = supervisor.state
        supervisor.stop()
        return state

    def stop_all(self) -> list[str]:
        """Stop all that is active, and accept further items; takes no lock. Returns the identifiers."""
        active = self._active
        for supervisor, _ in active.values():
            supervisor.stop()
        return [*active]

    def begin_close(self) -> None:
        """Stop all that is active and accept no further items; returns at once."""
        self._is_closed = True
        for supervisor, _ in self._active.values():
            supervisor.interrupt()

    def close(self) -> None:
        """Stop all that is active, and wait for its end for at most `CLOSE_TIMEOUT_S` each."""
        with self._lock:
            self.begin_close()
        for _, thread in self._active.values():
            thread.join(CLOSE_TIMEOUT_S)

    def _publish(self, staged: Path, claims: DeviceClaims, claim: tuple[str, str] | None, permit: Permit) -> str:
        """Make a staged folder an item that has its arm; the caller has the lock. Raises BusyError or LeaseError."""
        if self._is_closed:
            raise BusyError(f"the service is ending; hand the {self.noun} in when it is up again")
        if claim is not None:
            claims.take(*claim)
        try:
            # Only now: whoever leases an arm looks at the claims after the lease is written.
            permit.require()
            return self.items.publish(staged)
        except BaseException:
            if claim is not None:
                claims.release(*claim)
            raise

    def _supervise(self, identifier: str, supervisor: S, then: Callable[[], None] = lambda: None) -> None:
        def run() -> None:
            try:
                supervisor.run()
                then()
            finally:
                with self._registering:
                    self._active = {name: entry for name, entry in self._active.items() if name != identifier}

        thread = threading.Thread(target=run, name=f"supervise-{identifier}", daemon=True)
        with self._registering:
            self._active = {**self._active, identifier: (supervisor, thread)}
        thread.start()


_log = logging.getLogger("tauscope.jobs")
BEAT_S = 0.1  # how often the control process is told that its owner is alive, at least [s]
BEATS_A_HEARTBEAT = 5  # how often it is told so in the time after which it counts its owner as gone


class ControlProcess(Protocol):
    def stop(self) -> None:
        """Ask it to stop; returns at once, may be called at any time and any number of times."""

    def beat(self) -> None: ...

    def wait(self, timeout_s: float | None = None) -> RunRecord:
        """Wait for the end of the run [s], for good where None. Raises TimeoutError if it has not come by then."""
        ...


StartControl = Callable[[RunWorkspace, Report], ControlProcess]
"""Starts the control process of a run, which reports its events; raises TauscopeError where that cannot be."""


@dataclass(frozen=True)
class Live:
    state: RunState
    percent: float | None
    figures: Mapping[str, Any]


class RunSupervisor:
    """`stop` takes no lock and touches no disk: whatever else is stuck, it reaches the control process."""

    def __init__(
        self,
        workspace: RunWorkspace,
        start: StartControl,
        motion: Motion,
        is_alive: Callable[[], bool],
        permit: Permit = FREE,
    ) -> None:
        self.live = Live(RunState.CREATED, None, {})
        self._workspace, self._start, self._motion = workspace, start, motion
        self._is_alive, self._permit = is_alive, permit
        self._control: ControlProcess | None = None
        self._stop_requested = threading.Event()

    @property
    def state(self) -> RunState:
        return self.live.state

    def stop(self) -> None:
        """Stop the run, in whatever state it is; the arm has to be armed again before it moves again."""
        self._permit.disarm()
        self._halt()

    interrupt = stop

    def _halt(self) -> None:
        self._stop_requested.set()
        # Whoever starts the control process looks at the flag after it has told us of the process.
        control = self._control
        if control is not None:
            control.stop()

    def run(self) -> None:
        """Take the run to its end; never raises."""
        try:
            if self._motion(self._workspace, self._stop_requested):
                if not self._stop_requested.is_set():
                    self._permit.require()
                self._supervise()
            else:
                self._end(RunState.STOPPED)
        except StepFailedError as error:
            self._end(RunState.FAILED, error.problem.code, error.problem.detail)
        except TauscopeError as error:
            self._end(RunState.FAILED, error.code, self._workspace.in_user_terms(str(error)))
        except Exception:
            _log.exception("run %s failed for an unforeseen reason", self._workspace.folder.name)
            self._end(RunState.FAILED, "internal", "the run met a fault of Tauscope's own; the service's log says more")

    def _supervise(self) -> None:
        self._control = control = self._start(self._workspace, self._handle_event)
        if self._stop_requested.is_set():
            control.stop()
        request = self._workspace.read_order()
        beat_s = BEAT_S if request is None else min(BEAT_S, request.options.heartbeat_s / BEATS_A_HEARTBEAT)
        while True:
            # Two ways to the same end: the run is asked to stop, and hears nothing of its owner any more.
            if (lost := self._permit.find_end_reason()) is not None:
                self._stop_without_permit(lost)
            elif self._is_alive():
                control.beat()
            with suppress(TimeoutError):
                control.wait(beat_s)
                return

    def _stop_without_permit(self, why: str) -> None:
        """The leave to move has ended: stop, and say why; nothing is new where somebody has stopped the run already."""
        if not self._stop_requested.is_set():
            self._halt()
            _log.info("run %s is stopped: %s", self._workspace.folder.name, why)
            try:  # a disk that takes no step holds nothing up
                self._workspace.write_step(f"stop: {why}")
            except OSError:
                _log.exception("a step of run %s could not be written", self._workspace.folder.name)

    def _handle_event(self, event: Mapping[str, Any]) -> None:
        state = RunState(event["state"])
        if event["event"] == "state":
            self.live = Live(state, self.live.percent, self.live.figures)
            if not state.is_end:
                self._workspace.tell(StateEvent(time=datetime.fromisoformat(event["at"]), state=state))
        elif event["event"] == "progress":
            figures = {name: value for name, value in event.items() if name not in ("event", "state", "percent")}
            self.live = Live(state, float(event["percent"]), figures)
            self._workspace.write_progress(self.live.percent, figures)

    def _end(self, state: RunState, code: str | None = None, detail: str = "") -> None:
        if self._control is not None:
            self._control.stop()
            return
        problem = None if code is None else RunProblem(code=code, detail=detail)
        try:
            self._workspace.end_before_start(state, problem)
            self.live = Live(state, None, {})
        except OSError:
            # The disk is full or gone: the run becomes `interrupted` with the next start.
            _log.exception("the state of run %s could not be written", self._workspace.folder.name)


class RunManager(Manager[RunSupervisor]):
    noun = "run"

    def __init__(
        self,
        items: ItemStore,
        recordings: RecordingStore,
        start: StartControl,
        claims: DeviceClaims,
        is_alive: Callable[[], bool],
        on_end: Callable[[RunRecord], None] = lambda _record: None,
    ) -> None:
        super().__init__(items)
        self.claims, self._recordings, self._start = claims, recordings, start
        self._is_alive, self._on_end = is_alive, on_end
        self._pending: dict[str, RunWorkspace] = {}
        for identifier in items.identifiers():
            self._end(RunWorkspace(items.folder(identifier)), None)

    def submit(self, staged: Path, motion: Motion, holder: str | None = None, permit: Permit = FREE) -> str:
        """Start a run; `holder` has the arm already. Raises BusyError or LeaseError; the folder stays staged then."""
        workspace = RunWorkspace(staged)
        request = workspace.read_order()
        if request is None:
            raise TauscopeError("the run's request.json is missing or damaged; hand the run in again")
        workspace.create(request)
        claim = None if holder is not None else (request.device, f"run {staged_identifier(staged)}")
        with self._lock:
            identifier = self._publish(staged, self.claims, claim, permit)
            workspace = RunWorkspace(self.items.folder(identifier))
            supervisor = RunSupervisor(workspace, self._start, motion, self._is_alive, permit)

            def end() -> None:
                self._end(workspace, claim)
                if (record := workspace.read_record()) is not None:
                    self._on_end(record)

            self._supervise(identifier, supervisor, end)
        return identifier

    def live(self, identifier: str) -> Live | None:
        supervisor = self.find(identifier)
        return None if supervisor is None else supervisor.live

    def list_live(self) -> list[Live]:
        return [supervisor.live for supervisor, _ in self._active.values()]

    def settle(self) -> None:
        """Keep recordings that a full disk did not take. Raises OSError if it still does not."""
        for workspace in list(self._pending.values()):
            self._conclude(workspace)

    def _end(self, workspace: RunWorkspace, claim: tuple[str, str] | None) -> None:
        try:
            workspace.recover()
            self._conclude(workspace)
        except Exception:
            _log.exception("run %s could not be put in order", workspace.folder.name)
        finally:
            if claim is not None:
                self.claims.release(*claim)

    def _conclude(self, workspace: RunWorkspace) -> None:
        """Keep the recording of a run that has ended among the recordings, and tell the end; done once."""
        identifier = workspace.folder.name
        if workspace.has_told_end():
            self._pending.pop(identifier, None)
            return
        self._pending[identifier] = workspace
        path, record = workspace.recording("csv"), workspace.read_record()
        try:
            if record is not None and record.state.is_end and path.is_file():
                name = run_recording_name(identifier)
                self._recordings.keep(KeptFile(path, name, path.stat().st_size, hash_file(path)))
        except TauscopeError:
            _log.exception("the recording of run %s could not be kept", identifier)
        workspace.tell_end()
        self._pending.pop(identifier, None)


def run_recording_name(identifier: str) -> str:
    return f"run-{identifier}.csv"
