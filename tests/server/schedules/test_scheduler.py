"""What is due is done once, by one service; what cannot be done is said, and nothing is repeated by itself."""

import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, cast

import pytest

from tauscope.errors import NotFoundError, StoreError, TauscopeError
from tauscope.server.control.leases import BusyError, LeasedError
from tauscope.server.schedules.definition import ScheduleDefinition
from tauscope.server.schedules.repository import FiringEntry, ScheduleRepository
from tauscope.server.schedules.scheduler import FOLDER, NothingToDoError, Repeater, Scheduler
from tauscope.server.store.database.database import Database
from tauscope.server.store.database.index import Index
from tauscope.server.store.database.tables import Schedule

START = datetime(2026, 11, 2, 12, 0, tzinfo=UTC)


class Clock:
    """A clock that a test puts forward."""

    def __init__(self) -> None:
        self.now = START

    def __call__(self) -> datetime:
        self.now += timedelta(microseconds=1)
        return self.now

    def go(self, **length: float) -> None:
        self.now += timedelta(**length)


class Starts:
    """Stands for the campaigns and jobs: what was started, and what still goes on."""

    def __init__(self) -> None:
        self.started: list[str] = []
        self.going_on: set[tuple[str, str]] = set()
        self.hindrance: Callable[[], None] = lambda: None

    def start(self, entry: Schedule, since: datetime | None) -> tuple[str, str]:
        self.hindrance()
        self.started.append(entry.name)
        return "campaign", f"item-{len(self.started)}"

    def goes_on(self, kind: str, identifier: str) -> bool:
        return (kind, identifier) in self.going_on


def schedule(name: str = "nightly", site: str | None = "here", **changes: Any) -> Schedule:
    made = ScheduleDefinition.model_validate({"kind": "campaign", "every_s": 3600, **changes})
    due = made.next_after(START, START)
    return Schedule(
        name=name,
        site=site,
        definition=made.model_dump(mode="json"),
        order={"robot_name": "arm"},
        files={},
        created=START,
        next_due=due,
    )


class Service:
    """One service of a database."""

    def __init__(self, database: Database, clock: Clock, starts: Starts, folder: Path, site: str, boot: str) -> None:
        Index(database, site).register(site, START)
        self.repository = ScheduleRepository(database, site, boot)
        self.scheduler = Scheduler(self.repository, cast(Repeater, starts), folder, clock)

    def firings(self, name: str = "nightly") -> list[FiringEntry]:
        return self.repository.firings(name, 1000)[::-1]

    def states(self, name: str = "nightly") -> list[str]:
        return [firing.state for firing in self.firings(name)]


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def starts() -> Starts:
    return Starts()


@pytest.fixture
def service(database: Database, clock: Clock, starts: Starts, tmp_path: Path) -> Service:
    return Service(database, clock, starts, tmp_path, "here", "1")


def test_every_time_it_is_due_it_is_started_once(service: Service, clock: Clock, starts: Starts) -> None:
    service.repository.put(schedule())
    for _ in range(6):
        service.scheduler.tick()
        clock.go(minutes=30)
    assert starts.started == ["nightly"] * 2
    first, second = service.firings()
    assert (first.due, second.due) == (START + timedelta(hours=1), START + timedelta(hours=2))
    assert first.item == ("campaign", "item-1")
    assert service.repository.find("nightly").next_due == START + timedelta(hours=3)


def test_what_was_missed_is_made_up_for_once_or_passed_over(service: Service, clock: Clock, starts: Starts) -> None:
    service.repository.put(schedule("soon", every_s=60, grace_s=60))
    service.repository.put(schedule("late", every_s=3600, grace_s=60))
    clock.go(minutes=65)
    service.scheduler.tick()
    assert starts.started == ["soon"]
    assert service.states("soon") == ["started"]
    (late,) = service.firings("late")
    assert (late.state, late.reason) == ("missed", "no service looked at it until 5 minutes later; it is due again")
    assert service.repository.find("late").next_due == START + timedelta(hours=2)
    assert service.repository.find("soon").next_due == START + timedelta(minutes=66)


def test_what_still_goes_on_is_not_started_again(service: Service, clock: Clock, starts: Starts) -> None:
    service.repository.put(schedule())
    starts.going_on.add(("campaign", "item-1"))
    for _ in range(3):
        clock.go(hours=1)
        service.scheduler.tick()
    assert service.states() == ["started", "skipped", "skipped"]
    assert service.firings()[-1].reason == "what was started last, campaign item-1, still goes on"
    starts.going_on.clear()
    clock.go(hours=1)
    service.scheduler.tick()
    assert service.states()[-1] == "started"


@pytest.mark.parametrize(
    ("error", "state", "reason"),
    [
        (BusyError("arm on sim: run 7 has it"), "skipped", "arm on sim: run 7 has it"),
        (LeasedError("arm on sim: Ann has its lease"), "skipped", "arm on sim: Ann has its lease"),
        (NothingToDoError("no recording is newer"), "skipped", "no recording is newer"),
        (TauscopeError("the robot file is gone"), "failed", "the robot file is gone"),
        (ZeroDivisionError(), "failed", "a fault of Tauscope's own (ZeroDivisionError); see the log"),
    ],
)
def test_a_failure_is_written_down_and_not_repeated(
    error: Exception, state: str, reason: str, service: Service, clock: Clock, starts: Starts
) -> None:
    def fail() -> None:
        raise error

    service.repository.put(schedule())
    starts.hindrance = fail
    clock.go(hours=1)
    for _ in range(5):
        service.scheduler.tick()
    (firing,) = service.firings()
    assert (firing.state, firing.reason, firing.is_final) == (state, reason, True)


def test_nothing_is_started_outside_of_the_window(service: Service, clock: Clock, starts: Starts) -> None:
    service.repository.put(schedule(window={"start": "15:00", "end": "17:00"}))
    for _ in range(6):
        clock.go(hours=1)
        service.scheduler.tick()
    assert service.states() == ["skipped"] * 2 + ["started"] * 2 + ["skipped"] * 2
    assert "outside of its window, 15:00 to 17:00 (UTC)" in str(service.firings()[0].reason)


def test_the_interlock_has_the_last_word(service: Service, clock: Clock, starts: Starts, tmp_path: Path) -> None:
    service.repository.put(schedule(interlock="free"))
    clock.go(hours=1)
    service.scheduler.tick()
    (tmp_path / FOLDER).mkdir()
    (tmp_path / FOLDER / "free").write_text('#!/bin/sh\n[ "$1 / $2" = "arm / arm on sim" ]\n', encoding="utf-8")
    (tmp_path / FOLDER / "free").chmod(0o755)
    clock.go(hours=1)
    service.scheduler.tick()
    assert service.states() == ["skipped", "started"]
    assert "there is no program free" in str(service.firings()[0].reason)


def test_asked_for_it_is_done_now_and_the_timetable_stays(service: Service, starts: Starts) -> None:
    service.repository.put(schedule())
    assert service.scheduler.fire_now("nightly").state == "started"
    number = service.repository.ask("nightly", START)
    service.scheduler.tick()
    assert service.repository.firing(number).state == "started"
    assert starts.started == ["nightly"] * 2
    assert service.repository.find("nightly").next_due == START + timedelta(hours=1)
    with pytest.raises(NotFoundError, match="did you mean 'nightly'"):
        service.scheduler.fire_now("nighty")


def test_what_nobody_took_on_can_be_taken_back(service: Service, starts: Starts) -> None:
    service.repository.put(schedule(site="elsewhere"))
    number = service.repository.ask("nightly", START)
    service.scheduler.tick()
    assert service.repository.withdraw(number) is True
    assert service.repository.withdraw(number) is False
    assert (starts.started, service.states()) == ([], ["withdrawn"])


def test_a_service_that_died_in_the_middle_leaves_no_open_end_and_no_repetition(
    service: Service, database: Database, clock: Clock, starts: Starts, tmp_path: Path
) -> None:
    service.repository.put(schedule())
    clock.go(hours=1)

    def die() -> None:
        raise KeyboardInterrupt

    starts.hindrance = die
    with pytest.raises(KeyboardInterrupt):
        service.scheduler.tick()
    assert service.states() == ["claimed"]
    starts.hindrance = lambda: None
    again = Service(database, clock, starts, tmp_path, "here", "2")
    again.scheduler.tick()
    (firing,) = again.firings()
    assert (firing.state, firing.is_final) == ("interrupted", True)
    assert starts.started == []


def test_a_schedule_that_is_changed_or_removed(service: Service, clock: Clock, starts: Starts) -> None:
    service.repository.put(schedule())
    due = service.repository.due(START + timedelta(hours=2))
    service.repository.put(schedule(every_s=7200))
    assert service.repository.claim(due[0], None, clock()) is None  # what was read is old by now
    service.repository.put(schedule(enabled=False))
    clock.go(hours=5)
    service.scheduler.tick()
    assert starts.started == []
    service.repository.remove("nightly")
    assert service.repository.schedules() == []
    with pytest.raises(NotFoundError, match="there are none yet"):
        service.repository.remove("nightly")


def test_several_services_do_it_once(database: Database, clock: Clock, starts: Starts, tmp_path: Path) -> None:
    """Four services tick at the same time, twenty times; each time it is due for one of them only."""
    services = [Service(database, clock, starts, tmp_path, f"site{number}", "1") for number in range(4)]
    services[0].repository.put(schedule(site=None))
    services[0].repository.put(schedule("mine", site="site2"))
    barrier, failures = threading.Barrier(len(services)), list[BaseException]()

    def tick(service: Service) -> None:
        try:
            for _ in range(20):
                if barrier.wait(60) == 0:
                    clock.go(hours=1)
                barrier.wait(60)
                service.scheduler.tick()
        except BaseException as error:
            failures.append(error)
            barrier.abort()

    threads = [threading.Thread(target=tick, args=(service,)) for service in services]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    for name in ("nightly", "mine"):
        assert starts.started.count(name) == 20
        assert services[0].states(name) == ["started"] * 20
        assert len({firing.due for firing in services[0].firings(name)}) == 20
    assert {firing.site for firing in services[0].firings("mine")} == {"site2"}


def test_a_database_that_does_not_answer_delays_and_loses_nothing(
    service: Service, clock: Clock, starts: Starts, monkeypatch: pytest.MonkeyPatch
) -> None:
    service.repository.put(schedule())
    clock.go(hours=1)

    def locked(*_: object) -> None:
        raise StoreError("locked")

    with monkeypatch.context() as patched:
        patched.setattr(ScheduleRepository, "claim", locked)
        with pytest.raises(StoreError):
            service.scheduler.tick()
    service.scheduler.tick()
    assert (starts.started, service.states()) == (["nightly"], ["started"])


def test_what_was_started_while_the_database_was_locked_is_written_down_afterwards(
    service: Service, clock: Clock, starts: Starts, monkeypatch: pytest.MonkeyPatch
) -> None:
    service.repository.put(schedule())
    clock.go(hours=1)

    def locked(*_: object) -> None:
        raise StoreError("locked")

    with monkeypatch.context() as patched:
        patched.setattr(ScheduleRepository, "finish", locked)
        with pytest.raises(StoreError):
            service.scheduler.tick()
    assert service.states() == ["claimed"]
    service.scheduler.tick()
    (firing,) = service.firings()
    assert (firing.state, firing.item) == ("started", ("campaign", "item-1"))
    assert starts.started == ["nightly"]
