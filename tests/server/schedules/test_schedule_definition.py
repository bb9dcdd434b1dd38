"""When schedules are due, by the calendar and the clock on the wall."""

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from pydantic import ValidationError

from tauscope.server.schedules.definition import ScheduleDefinition, Window

SATURDAY = datetime(2026, 10, 24, 12, 0, tzinfo=UTC)


def definition(**changes: Any) -> ScheduleDefinition:
    return ScheduleDefinition.model_validate({"kind": "campaign", **changes})


def dues(made: ScheduleDefinition, count: int, start: datetime = SATURDAY) -> list[str]:
    found, moment = [], start
    for _ in range(count):
        due = made.next_after(moment, SATURDAY)
        assert due is not None
        assert due.tzinfo is UTC
        found.append(f"{due:%d %H:%M:%S}")
        moment = due
    return found


def test_cron_is_the_clock_on_the_wall_also_when_that_is_put_back() -> None:
    # On Sunday the 25th of October 2026 the clocks of Berlin go back at three.
    assert dues(definition(cron="30 4 * * *", timezone="Europe/Berlin"), 3) == [
        "25 03:30:00",
        "26 03:30:00",
        "27 03:30:00",
    ]
    assert dues(definition(cron="30 4 * * *", timezone="Europe/Berlin"), 1, SATURDAY - timedelta(days=1)) == [
        "24 02:30:00"
    ]


def test_weekdays_have_their_names() -> None:
    assert dues(definition(cron="0 2 * * mon-fri"), 6) == [f"{day} 02:00:00" for day in (26, 27, 28, 29, 30)] + [
        "02 02:00:00"
    ]


def test_an_interval_is_counted_from_when_it_was_set_up_whatever_was_missed() -> None:
    every = definition(every_s=3600)
    assert dues(every, 2) == ["24 13:00:00", "24 14:00:00"]
    assert every.next_after(SATURDAY + timedelta(hours=5, minutes=1), SATURDAY) == SATURDAY + timedelta(hours=6)
    assert every.next_after(SATURDAY + timedelta(hours=5), SATURDAY) == SATURDAY + timedelta(hours=6)


def test_what_is_not_enabled_is_never_due() -> None:
    assert definition(every_s=60, enabled=False).next_after(SATURDAY, SATURDAY) is None


@pytest.mark.parametrize(
    ("moment", "is_open"),
    [
        ("2026-11-02 21:59", False),  # a Monday
        ("2026-11-02 22:00", True),
        ("2026-11-03 04:59", True),
        ("2026-11-03 05:00", False),
        ("2026-11-07 02:00", True),  # the night that began on Friday
        ("2026-11-07 23:00", False),  # Saturday
        ("2026-11-09 02:00", False),  # the night that began on Sunday
    ],
)
def test_a_window_over_midnight_belongs_to_the_day_on_which_it_begins(moment: str, is_open: bool) -> None:
    window = Window(days=("mon", "tue", "wed", "thu", "fri"), start="22:00", end="05:00")
    assert window.holds(datetime.fromisoformat(moment)) is is_open


def test_other_windows() -> None:
    day, always = Window(start="08:00", end="17:00"), Window(days=("sun",), start="00:00", end="00:00")
    sunday = datetime(2026, 11, 1)
    assert [day.holds(sunday.replace(hour=hour)) for hour in (7, 8, 16, 17)] == [False, True, True, False]
    assert [always.holds(sunday + timedelta(hours=hours)) for hours in (-1, 0, 23, 24)] == [False, True, True, False]
    night = definition(cron="0 0 * * *", timezone="Asia/Tokyo", window=Window(start="00:00", end="01:00"))
    assert night.is_open(datetime(2026, 11, 1, 15, 30, tzinfo=UTC))
    assert not night.is_open(datetime(2026, 11, 1, 16, 0, tzinfo=UTC))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "either cron or every_s"),
        ({"cron": "0 2 * * *", "every_s": 60}, "either cron or every_s"),
        ({"cron": "0 25 * * *"}, "cron: .*as in 0 2"),
        ({"cron": "0 2 * *"}, "cron: .*as in 0 2"),
        ({"cron": "0 2 * * xyz"}, "cron: .*as in 0 2"),
        ({"every_s": 1}, "every_s"),
        ({"every_s": 60, "timezone": "Mars/Olympus"}, "no time zone"),
        ({"every_s": 60, "timezone": "../../etc/passwd"}, "no time zone"),
        ({"every_s": 60, "interlock": "../free"}, "interlock"),
        ({"every_s": 60, "recordings": {"pattern": "*"}}, "recordings"),
        ({"every_s": 60, "window": {"start": "24:00", "end": "05:00"}}, "window"),
        ({"kind": "diagnosis", "every_s": 60}, "which it takes"),
    ],
)
def test_what_makes_no_sense_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        ScheduleDefinition.model_validate({"kind": "campaign", **changes})
