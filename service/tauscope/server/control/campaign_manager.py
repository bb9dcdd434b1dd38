"""The campaign manager: it starts, stops and removes campaigns; after a restart only their analysis continues."""

from pathlib import Path

from tauscope.errors import TauscopeError
from tauscope.server.control.campaign import CampaignWorkspace
from tauscope.server.control.campaign_runner import CampaignDependencies, CampaignRunner
from tauscope.server.control.device_claims import BusyError
from tauscope.server.control.leases import FREE, Permit
from tauscope.server.control.supervised_threads import Manager
from tauscope.server.queue.queue import INTERRUPTED
from tauscope.server.queue.record import JobRecord, JobState
from tauscope.server.store.items import ItemStore, staged_identifier


class CampaignManager(Manager[CampaignRunner]):
    """The active campaigns, and the folders of all campaigns."""

    def __init__(self, items: ItemStore, dependencies: CampaignDependencies) -> None:
        """Continue the analysis of unfinished campaigns whose motions were all recorded.

        The others become `interrupted`: nothing moves by itself.
        """
        super().__init__(items)
        self._dependencies = dependencies
        for identifier in items.identifiers():
            self._resume(CampaignWorkspace(items.folder(identifier)))

    def submit(self, staged: Path, permit: Permit = FREE) -> str:
        """Start a campaign; it claims the arm until its motions are done.

        Raises BusyError if somebody else has the arm; the folder stays staged. Raises LeaseError if the arm may not be
        moved by that leave; the folder stays staged.
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
            claims = self._dependencies.runs.claims
            runner = CampaignRunner(workspace, order, self._dependencies, lambda: claims.release(*claim), permit)
            self._threads.start(identifier, runner)
        return identifier

    def stop(self, identifier: str) -> JobState | None:
        """Stop a campaign: takes no lock, waits for nothing, may be called any number of times.

        Returns JobState or None: where the campaign stood; None where nothing of it goes on.
        """
        runner = self._threads.find(identifier)
        if runner is None:
            return None
        state = runner.state
        runner.stop()
        return state

    def _resume(self, workspace: CampaignWorkspace) -> None:
        """Continue or end a campaign of an earlier service."""
        record, order = workspace.read_record(), workspace.read_order()
        if record is None or record.state.is_end:
            workspace.tell_lost_end()
        elif order is not None and workspace.read_made().recordings:
            runner = CampaignRunner(workspace, order, self._dependencies, lambda: None)
            self._threads.start(workspace.folder.name, runner)
        else:
            workspace.write_record(record.moved(JobState.INTERRUPTED, self.items.clock(), INTERRUPTED))
