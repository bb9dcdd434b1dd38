"""How far the active models of a data folder have drifted, at hand for whoever asks and does not wait."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from tauscope.errors import NotFoundError
from tauscope.server.history import Drift
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.history.model_judgement import compared

_MOST_EVENTS = 10_000


@dataclass(frozen=True)
class RobotDrift:
    """The active model of a robot against the one that drift is counted from."""

    active: str
    reference: str
    drifts: tuple[Drift, ...]
    open_events: int


class DriftMonitor:
    """Looks at the history now and then; models are read again only where others became active or the reference."""

    def __init__(self, history: ModelHistory, site: str) -> None:
        """Prepare; nothing is known before `look`."""
        self._history, self._site = history, site
        self.robots: Mapping[str, RobotDrift] = {}

    def look(self) -> None:
        """Bring what is known up to date.

        Raises
        ------
        StoreError
            if the database does not answer; what was known before stays
        """
        pairs = self._history.active_and_reference(self._site)
        told = self._history.events(None, only_open=True, limit=_MOST_EVENTS) if pairs else []
        events = Counter(event.robot for event in told if event.kind == "drift")
        known = self.robots
        self.robots = {
            robot: RobotDrift(*pair, self._drifts(known.get(robot), *pair), events[robot])
            for robot, pair in pairs.items()
        }

    def _drifts(self, known: RobotDrift | None, active: str, reference: str) -> tuple[Drift, ...]:
        """The change between two models."""
        if known is not None and (known.active, known.reference) == (active, reference):
            return known.drifts
        try:
            return compared(self._history.document(reference), self._history.document(active))
        except NotFoundError:  # it was removed a moment ago
            return ()
