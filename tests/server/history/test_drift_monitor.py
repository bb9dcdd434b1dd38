"""How far models have drifted, as it is told without asking the database, on both kinds of it."""

from datetime import timedelta

import pytest

from identified import NOON, candidate, identified
from tauscope.errors import StoreError
from tauscope.server.history.model_history import ModelHistory
from tauscope.server.history.model_registry import DriftMonitor
from tauscope.server.store.database.database import Database
from tauscope.server.store.database.index import Index, ItemMetadata


@pytest.fixture
def history(database: Database) -> ModelHistory:
    """Of two arms, about which something is kept already."""
    for site in ("here", "elsewhere"):
        Index(database, site).register(site, NOON)
    for number, robot in enumerate(("arm", "other"), start=1):
        facts = ItemMetadata("run", f"20251103T110000Z-0000000{number}", "finished", True, "9", NOON, robot=robot)
        Index(database, "here").put([facts])
    return ModelHistory(database)


def consider(history: ModelHistory, day: int, viscous: float, robot: str = "arm", site: str = "here") -> str:
    document = identified({"viscous": viscous}, friction__0__std__viscous=0.01)
    given = candidate(day, document, robot=robot, site=site)
    entry = history.consider(given, given.created + timedelta(minutes=1))
    assert entry.state == "active"
    return entry.identifier


def viscous_share(watch: DriftMonitor, robot: str = "arm") -> float:
    (drift,) = (drift for drift in watch.robots[robot].drifts if drift.name == "viscous shoulder")
    return drift.share


def test_the_active_model_is_compared_with_the_reference(history: ModelHistory) -> None:
    watch = DriftMonitor(history, "here")
    watch.look()
    assert watch.robots == {}
    consider(history, 1, 0.5)
    watch.look()
    assert (viscous_share(watch), watch.robots["arm"].open_events) == (0.0, 0)
    second = consider(history, 30, 0.7)
    watch.look()
    assert viscous_share(watch) == pytest.approx(0.4)
    assert watch.robots["arm"].open_events == 1
    (event,) = history.events("arm", only_open=True, limit=10)
    history.acknowledge(event.number, "greased", NOON)
    watch.look()
    assert (viscous_share(watch), watch.robots["arm"].open_events) == (pytest.approx(0.4), 0)
    history.activate(second, "reference", "new gear", NOON)
    watch.look()
    assert viscous_share(watch) == 0.0


def test_each_service_tells_of_the_models_that_it_holds(history: ModelHistory) -> None:
    consider(history, 1, 0.5)
    consider(history, 2, 0.5, robot="other", site="elsewhere")
    told = []
    for site in ("here", "elsewhere"):
        watch = DriftMonitor(history, site)
        watch.look()
        told.append(set(watch.robots))
    assert told == [{"arm"}, {"other"}]


def test_models_are_read_again_only_where_they_are_others(
    history: ModelHistory, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []
    document = history.document
    monkeypatch.setattr(history, "document", lambda identifier: read.append(identifier) or document(identifier))
    watch = DriftMonitor(history, "here")
    consider(history, 1, 0.5)
    for _ in range(3):
        watch.look()
    assert len(read) == 2
    consider(history, 2, 0.6)
    watch.look()
    assert len(read) == 4


def test_what_is_known_stays_while_the_database_is_away(history: ModelHistory, monkeypatch: pytest.MonkeyPatch) -> None:
    watch = DriftMonitor(history, "here")
    consider(history, 1, 0.5)
    watch.look()

    def away(_site: str) -> dict[str, tuple[str, str]]:
        raise StoreError("the database does not answer")

    monkeypatch.setattr(history, "active_and_reference", away)
    with pytest.raises(StoreError):
        watch.look()
    assert viscous_share(watch) == 0.0
