"""All runs: taken, led in threads of their own, stopped at once, and found interrupted after a restart."""

import logging
import threading
from collections.abc import Callable
from pathlib import Path

from tauscope.errors import TauscopeError
from tauscope.runtime.record import RunRecord
from tauscope.server.control.device_claims import BusyError, DeviceClaims
from tauscope.server.control.leases import FREE, Permit
from tauscope.server.control.motions import Motion
from tauscope.server.control.run import RunWorkspace
from tauscope.server.control.run_supervisor import Live, RunSupervisor, StartControl
from tauscope.server.control.supervised_threads import SupervisedThreads
from tauscope.server.store.files import KeptFile, hash_file
from tauscope.server.store.items import ItemStore, staged_identifier
from tauscope.server.store.recordings import RecordingStore

_log = logging.getLogger("tauscope.jobs")

PATIENCE_S = 15.0
"""How long a run may take to stop when the service ends; its control process outlasts it where need be [s]."""


class RunManager:
    """Runs that go on, and the folders of all runs. Every method may be called from any thread."""

    def __init__(
        self,
        items: ItemStore,
        recordings: RecordingStore,
        start: StartControl,
        claims: DeviceClaims,
        is_alive: Callable[[], bool],
        on_end: Callable[[RunRecord], None] = lambda _record: None,
    ) -> None:
        """Open the desk; runs that an earlier service left unfinished become `interrupted`."""
        self.items = items
        self.claims = claims
        self._recordings = recordings
        self._start = start
        self._is_alive = is_alive
        self._on_end = on_end
        self._lock = threading.Lock()
        self._led: SupervisedThreads[RunSupervisor] = SupervisedThreads()
        self._is_closed = False
        self._unkept: dict[str, RunWorkspace] = {}
        items.tidy()
        for identifier in items.identifiers():
            self._end(RunWorkspace(items.folder(identifier)), None)

    def submit(self, staged: Path, motion: Motion, holder: str | None = None, permit: Permit = FREE) -> str:
        """Take a run; it begins at once.

        Parameters
        ----------
        holder : str or None
            who has the arm already, to whom the run belongs; None where the run takes the arm itself

        Raises
        ------
        BusyError
            if somebody else has the arm; the folder stays staged
        LeaseError
            if the arm may not be moved by that leave; the folder stays staged
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
            leader = RunSupervisor(workspace, self._start, motion, self._is_alive, permit)
            self._led.begin(identifier, leader, lambda: self._end_led(workspace, claim))
        return identifier

    def stop(self, identifier: str) -> Live | None:
        """Stop a run, in whatever state it is: takes no lock, waits for nothing, may be called any number of times.

        Returns
        -------
        Live or None
            where the run stood; None where it does not go on
        """
        leader = self._led.find(identifier)
        if leader is None:
            return None
        leader.stop()
        return leader.live

    def live(self, identifier: str) -> Live | None:
        """What is known of a run that goes on; None of any other."""
        leader = self._led.find(identifier)
        return None if leader is None else leader.live

    def remove(self, identifier: str) -> bool:
        """Remove a run that has ended, with all its files; what is kept among the recordings stays.

        Returns
        -------
        bool
            False where the run goes on

        Raises
        ------
        NotFoundError
            if there is no such run
        """
        if self._led.find(identifier) is not None:
            return False
        self.items.remove(identifier)
        return True

    def lives(self) -> list[Live]:
        """What is known of each run that goes on."""
        return [leader.live for leader in self._led.supervisors()]

    def settle(self) -> None:
        """Keep the recordings that a full disk did not take; to be called again and again.

        Raises
        ------
        OSError
            if the disk is in the way still
        """
        for workspace in list(self._unkept.values()):
            self._conclude(workspace)

    def stop_all(self) -> list[str]:
        """Stop every run that goes on, and go on taking further ones; takes no lock. The runs' identifiers."""
        return [identifier for identifier in self._led.identifiers() if self.stop(identifier) is not None]

    def stop_all(self) -> None:
        """Stop every run and take no further ones; returns at once."""
        self._is_closed = True
        for leader in self._led.supervisors():
            leader.stop()

    def close(self) -> None:
        """Stop every run, and wait until all have ended or patience has."""
        with self._lock:
            self.stop_all()
        self._led.join(PATIENCE_S)

    def _end_led(self, workspace: RunWorkspace, claim: tuple[str, str] | None) -> None:
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
            self._unkept.pop(identifier, None)
            return
        self._unkept[identifier] = workspace
        try:
            self._keep_recording(workspace)
        except TauscopeError:
            _log.exception("the recording of run %s could not be kept", identifier)
        workspace.tell_end()
        self._unkept.pop(identifier, None)

    def _keep_recording(self, workspace: RunWorkspace) -> None:
        """Give the CSV of a run a name among the recordings; both names share the bytes on the disk."""
        path, record = workspace.recording("csv"), workspace.read_run()
        if record is not None and record.state.is_end and path.is_file():
            name = run_recording_name(workspace.folder.name)
            self._recordings.keep(KeptFile(path, name, path.stat().st_size, hash_file(path)))


def run_recording_name(identifier: str) -> str:
    """What the recording of a run is called among the recordings."""
    return f"run-{identifier}.csv"
