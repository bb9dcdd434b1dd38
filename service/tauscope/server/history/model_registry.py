"""The model registry: it judges each new identification once, and monitors the drift of active models."""

import logging
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime

from sqlalchemy.exc import IntegrityError

from tauscope.errors import NotFoundError
from tauscope.runtime.drivers import driver_names, find_driver
from tauscope.server.control.campaign import CampaignWorkspace
from tauscope.server.control.run import RunWorkspace
from tauscope.server.history.drift import Drift
from tauscope.server.history.model_history import ModelEntry, ModelHistory
from tauscope.server.history.model_judgement import Candidate, compare_models
from tauscope.server.queue.analyses import DiagnosisWorkspace, IdentificationOrder, IdentificationWorkspace
from tauscope.server.store.data_folder import ItemStore

_log = logging.getLogger("tauscope.jobs")


class ModelRegistry:
    """Brings identifications before the history of models, in the order in which they were handed in."""

    def __init__(self, history: ModelHistory, site: str, items: Mapping[str, ItemStore]) -> None:
        self.history, self._site = history, site
        self._identifications = items["identification"]
        self._diagnoses, self._campaigns, self._runs = items["diagnosis"], items["campaign"], items["run"]
        self._failed: set[str] = set()

    def judge_new(self) -> list[ModelEntry]:
        """Judge every indexed identification that was not. Raises StoreError; the next call goes on there."""
        return [entry for identifier in self.history.list_unjudged(self._site) if (entry := self._consider(identifier))]

    def _consider(self, identifier: str) -> ModelEntry | None:
        """Judge one identification; None where it was judged, waits for its diagnosis, or names an unknown robot."""
        try:
            workspace = IdentificationWorkspace(self._identifications.folder(identifier))
        except NotFoundError:
            return None
        order, record = workspace.read_order(), workspace.read_record()
        campaign = self._campaign(identifier)
        if order is None or record is None or (campaign is not None and not campaign.has_ended()):
            return None
        candidate = Candidate(
            identifier=identifier,
            site=self._site,
            robot=order.robot_name,
            created=record.created,
            source=self._source(order),
            result=workspace.read_result(),
            diagnosis=None if campaign is None else self._diagnosis(campaign.read_made().diagnosis),
        )
        try:
            entry = self.history.consider(candidate, datetime.now(UTC))
        except IntegrityError:
            return None
        except NotFoundError as error:  # the order was damaged; one such identification holds up no service
            if identifier not in self._failed:
                _log.warning("identification %s is not judged, its order may be damaged: %s", identifier, error)
            self._failed.add(identifier)
            return None
        _log.info("model %s of %s is %s", identifier, entry.robot, entry.state)
        return entry

    def _campaign(self, identification: str) -> CampaignWorkspace | None:
        for name in self._campaigns.identifiers():
            with suppress(NotFoundError):
                workspace = CampaignWorkspace(self._campaigns.folder(name))
                if workspace.read_made().identification == identification:
                    return workspace
        return None

    def _diagnosis(self, identifier: str | None) -> bytes | None:
        with suppress(NotFoundError):
            return None if identifier is None else DiagnosisWorkspace(self._diagnoses.folder(identifier)).read_result()
        return None

    def _source(self, order: IdentificationOrder) -> str:
        """What was measured: one simulated recording makes all of it simulated."""
        backends = {self._backend(entry.name) for entry in order.recordings if entry.origin == "server"} - {None}
        if any(find_driver(name).is_simulated for name in driver_names() if name in backends):
            return "simulated"
        return "arm" if backends else "uploaded"

    def _backend(self, recording: str) -> str | None:
        """The backend of the run that a recording is of; None where it is of none that is kept here."""
        identifier = recording.removeprefix("run-").removesuffix(".csv")
        try:
            request = RunWorkspace(self._runs.folder(identifier)).read_order()
        except NotFoundError:
            return None
        return None if request is None else request.backend.name


_MOST_EVENTS = 10_000


@dataclass(frozen=True)
class RobotDrift:
    active: str
    reference: str
    drifts: tuple[Drift, ...]
    open_events: int


class DriftMonitor:
    """Looks at the history now and then; models are read again only where others became active or the reference."""

    def __init__(self, history: ModelHistory, site: str) -> None:
        self._history, self._site = history, site
        self.robots: Mapping[str, RobotDrift] = {}

    def look(self) -> None:
        """Compare the models. Raises StoreError if the database does not answer; what was known before stays."""
        pairs = self._history.active_and_reference(self._site)
        told = self._history.events(None, only_open=True, limit=_MOST_EVENTS) if pairs else []
        events = Counter(event.robot for event in told if event.kind == "drift")
        known = self.robots
        self.robots = {
            robot: RobotDrift(*pair, self._drifts(known.get(robot), *pair), events[robot])
            for robot, pair in pairs.items()
        }

    def _drifts(self, known: RobotDrift | None, active: str, reference: str) -> tuple[Drift, ...]:
        if known is not None and (known.active, known.reference) == (active, reference):
            return known.drifts
        try:
            return compare_models(self._history.document(reference), self._history.document(active))
        except NotFoundError:  # it was removed a moment ago
            return ()
