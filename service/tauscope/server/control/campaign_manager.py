"""All campaigns: taken, led in threads of their own, stopped at once; after a restart only analysis goes on."""

import threading
from pathlib import Path

from tauscope.errors import TauscopeError
from tauscope.server.control.campaign import CampaignWorkspace
from tauscope.server.control.campaign_runner import CampaignDependencies, CampaignRunner
from tauscope.server.control.device_claims import BusyError
from tauscope.server.control.leases import FREE, Permit
from tauscope.server.control.supervised_threads import SupervisedThreads
from tauscope.server.queue.queue import INTERRUPTED
from tauscope.server.queue.record import JobRecord, JobState
from tauscope.server.store.items import ItemStore, staged_identifier

PATIENCE_S = 15.0
"""How long a campaign may take to stop when the service ends [s]."""


class CampaignManager:
    """Campaigns that go on, and the folders of all campaigns. Every method may be called from any thread."""

    def __init__(self, items: ItemStore, dependencies: CampaignDependencies) -> None:
        """Open the desk.

        Of the campaigns that an earlier service left unfinished, those whose motions had all been recorded go on with
        the identification; the others become `interrupted`: nothing moves by itself.
        """
        self.items = items
        self._dependencies = dependencies
        self._lock = threading.Lock()
        self._led: SupervisedThreads[CampaignRunner] = SupervisedThreads()
        self._is_closed = False
        items.tidy()
        for identifier in items.identifiers():
            self._take_up(CampaignWorkspace(items.folder(identifier)))

    def submit(self, staged: Path, permit: Permit = FREE) -> str:
        """Take a campaign; it begins at once, and has the arm until its motions are done.

        Raises
        ------
        BusyError
            if somebody else has the arm; the folder stays staged
        LeaseError
            if the arm may not be moved by that leave; the folder stays staged
        """
        workspace = CampaignWorkspace(staged)
        order = workspace.read_order()
        if order is None:
            raise TauscopeError("the campaign's order.json is missing or damaged; hand the campaign in again")
        claim = order.backend.device(order.robot_name), f"campaign {staged_identifier(staged)}"
        with self._lock:
            if self._is_closed:
                raise BusyError("the service is ending; hand the campaign in when it is up again")
            self._dependencies.runs.claims.take(*claim)
            try:
                permit.require()
                workspace.write_record(JobRecord(state=JobState.QUEUED, created=self.items.clock()))
                identifier = self.items.publish(staged)
            except BaseException:
                self._dependencies.runs.claims.release(*claim)
                raise
            workspace = CampaignWorkspace(self.items.folder(identifier))
            leader = CampaignRunner(
                workspace, order, self._dependencies, lambda: self._dependencies.runs.claims.release(*claim), permit
            )
            self._led.begin(identifier, leader, lambda: None)
        return identifier

    def stop(self, identifier: str) -> JobState | None:
        """Stop a campaign: takes no lock, waits for nothing, may be called any number of times.

        Returns
        -------
        JobState or None
            where the campaign stood; None where nothing of it goes on
        """
        leader = self._led.find(identifier)
        if leader is None:
            return None
        state = leader.state
        leader.stop()
        return state

    def remove(self, identifier: str) -> bool:
        """Remove a campaign that has ended; what it made stays.

        Returns
        -------
        bool
            False where the campaign goes on

        Raises
        ------
        NotFoundError
            if there is no such campaign
        """
        if self._led.find(identifier) is not None:
            return False
        self.items.remove(identifier)
        return True

    def stop_all(self) -> list[str]:
        """Stop every campaign that goes on, and go on taking further ones; takes no lock. Their identifiers."""
        return [identifier for identifier in self._led.identifiers() if self.stop(identifier) is not None]

    def stop_all(self) -> None:
        """Stop every campaign and take no further ones; returns at once."""
        self._is_closed = True
        for leader in self._led.supervisors():
            leader.interrupt()

    def close(self) -> None:
        """Stop every campaign, and wait until all have ended or patience has."""
        with self._lock:
            self.stop_all()
        self._led.join(PATIENCE_S)

    def _take_up(self, workspace: CampaignWorkspace) -> None:
        """What becomes of a campaign of an earlier service."""
        record, order = workspace.read_record(), workspace.read_order()
        if record is None or record.state.is_end:
            workspace.tell_lost_end()
        elif order is not None and workspace.read_made().recordings:
            leader = CampaignRunner(workspace, order, self._dependencies, lambda: None)
            self._led.begin(workspace.folder.name, leader, lambda: None)
        else:
            workspace.write_record(record.moved(JobState.INTERRUPTED, self.items.clock(), INTERRUPTED))
