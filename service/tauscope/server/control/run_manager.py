"""The run manager: it starts, stops and removes runs, and stores their recordings."""

import logging
from collections.abc import Callable
from pathlib import Path

from tauscope.errors import TauscopeError
from tauscope.runtime.record import RunRecord
from tauscope.server.control.device_claims import BusyError, DeviceClaims
from tauscope.server.control.leases import FREE, Permit
from tauscope.server.control.motions import Motion
from tauscope.server.control.run import RunWorkspace
from tauscope.server.control.run_supervisor import Live, RunSupervisor, StartControl
from tauscope.server.control.supervised_threads import Manager
from tauscope.server.store.files import KeptFile, hash_file
from tauscope.server.store.items import ItemStore, staged_identifier
from tauscope.server.store.recordings import RecordingStore

_log = logging.getLogger("tauscope.jobs")


class RunManager(Manager[RunSupervisor]):
    """The active runs, and the folders of all runs."""

    def __init__(
        self,
        items: ItemStore,
        recordings: RecordingStore,
        start: StartControl,
        claims: DeviceClaims,
        is_alive: Callable[[], bool],
        on_end: Callable[[RunRecord], None] = lambda _record: None,
    ) -> None:
        """Mark the unfinished runs of an earlier service as `interrupted`."""
        super().__init__(items)
        self.claims = claims
        self._recordings = recordings
        self._start = start
        self._is_alive = is_alive
        self._on_end = on_end
        self._pending: dict[str, RunWorkspace] = {}
        for identifier in items.identifiers():
            self._end(RunWorkspace(items.folder(identifier)), None)

    def submit(self, staged: Path, motion: Motion, holder: str | None = None, permit: Permit = FREE) -> str:
        """Start a run.

        Raises BusyError if somebody else has the arm; the folder stays staged. Raises LeaseError if the arm may not be
        moved by that leave; the folder stays staged.

        `holder`: who has the arm already, to whom the run belongs; None where the run takes the arm itself.
        """
        workspace = RunWorkspace(staged)
        request = workspace.read_order()
        if request is None:
            raise TauscopeError("the run's request.json is missing or damaged; hand the run in again")
        workspace.create(request)
        claim = None if holder is not None else (request.device, f"run {staged_identifier(staged)}")
        with self._lock:
            if self._is_closed:
                raise BusyError("the service is ending; hand the run in when it is up again")
            if claim is not None:
                self.claims.take(*claim)
            try:
                # Only now: whoever leases an arm looks at the claims after the lease is written.
                permit.require()
                identifier = self.items.publish(staged)
            except BaseException:
                self._release(claim)
                raise
            workspace = RunWorkspace(self.items.folder(identifier))
            supervisor = RunSupervisor(workspace, self._start, motion, self._is_alive, permit)
            self._threads.start(identifier, supervisor, lambda: self._end_supervised(workspace, claim))
        return identifier

    def stop(self, identifier: str) -> Live | None:
        """Stop a run, in whatever state it is: takes no lock, waits for nothing, may be called any number of times.

        Returns Live or None: where the run stood; None where it does not go on.
        """
        supervisor = self._threads.find(identifier)
        if supervisor is None:
            return None
        supervisor.stop()
        return supervisor.live

    def live(self, identifier: str) -> Live | None:
        """The status of an active run; None for any other."""
        supervisor = self._threads.find(identifier)
        return None if supervisor is None else supervisor.live

    def list_live(self) -> list[Live]:
        """The status of each active run."""
        return [supervisor.live for supervisor in self._threads.supervisors()]

    def settle(self) -> None:
        """Keep the recordings that a full disk did not take; to be called again and again.

        Raises OSError if the disk is in the way still.
        """
        for workspace in list(self._pending.values()):
            self._conclude(workspace)

    def _end_supervised(self, workspace: RunWorkspace, claim: tuple[str, str] | None) -> None:
        """Put everything in its place, and tell whoever counts."""
        self._end(workspace, claim)
        record = workspace.read_run()
        if record is not None:
            self._on_end(record)

    def _end(self, workspace: RunWorkspace, claim: tuple[str, str] | None) -> None:
        """Put everything in its place after a run."""
        try:
            workspace.recover()
            self._conclude(workspace)
        except Exception:
            _log.exception("run %s could not be put in order", workspace.folder.name)
        finally:
            self._release(claim)

    def _release(self, claim: tuple[str, str] | None) -> None:
        """Let go of the arm, where the run took it itself."""
        if claim is not None:
            self.claims.release(*claim)

    def _conclude(self, workspace: RunWorkspace) -> None:
        """Keep the recording of a run that has ended among the recordings, and tell the end; done once."""
        identifier = workspace.folder.name
        if workspace.has_told_end():
            self._pending.pop(identifier, None)
            return
        self._pending[identifier] = workspace
        try:
            self._keep_recording(workspace)
        except TauscopeError:
            _log.exception("the recording of run %s could not be kept", identifier)
        workspace.tell_end()
        self._pending.pop(identifier, None)

    def _keep_recording(self, workspace: RunWorkspace) -> None:
        """Give the CSV of a run a name among the recordings; both names share the bytes on the disk."""
        path, record = workspace.recording("csv"), workspace.read_run()
        if record is not None and record.state.is_end and path.is_file():
            name = run_recording_name(workspace.folder.name)
            self._recordings.keep(KeptFile(path, name, path.stat().st_size, hash_file(path)))


def run_recording_name(identifier: str) -> str:
    """What the recording of a run is called among the recordings."""
    return f"run-{identifier}.csv"
