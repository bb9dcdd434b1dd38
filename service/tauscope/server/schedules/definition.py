"""When a schedule is due, and what has to be so before anything is started."""

from datetime import UTC, datetime, time, timedelta
from typing import Annotated, Literal, Self
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from apscheduler.triggers.base import BaseTrigger
from apscheduler.triggers.cron import CronTrigger
from apscheduler.triggers.interval import IntervalTrigger
from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from tauscope.strict_model import StrictModel

DAYS = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
Day = Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"]
ClockTime = Annotated[str, Field(pattern=r"^([01]\d|2[0-3]):[0-5]\d$", examples=["22:00"])]


def _time_zone(value: str) -> str:
    try:
        ZoneInfo(value)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise PydanticCustomError("time_zone", "is no time zone; write one such as Europe/Berlin or UTC") from None
    return value


class Window(StrictModel):
    """When work may be started, by the clock on the wall; an `end` before `start` is on the next day."""

    days: tuple[Day, ...] = Field(default=DAYS, min_length=1, description="on which the window begins")
    start: ClockTime = Field(description="first moment")
    end: ClockTime = Field(description="first moment after it; the same as `start` for the whole day")

    def holds(self, moment: datetime) -> bool:
        start, end = time.fromisoformat(self.start), time.fromisoformat(self.end)
        now, today = moment.time(), DAYS[moment.weekday()]
        yesterday = DAYS[(moment - timedelta(days=1)).weekday()]
        if start < end:
            return today in self.days and start <= now < end
        return (today in self.days and now >= start) or (yesterday in self.days and now < end)


class RecordingChoice(StrictModel):
    """Which recordings on the server an analysis takes: the newest of those that match."""

    pattern: str = Field(min_length=1, max_length=200, description="of names, as in a shell", examples=["cell3-*"])
    train: int = Field(default=1, ge=1, le=100, description="how many the model is made from")
    held_out: int = Field(default=1, ge=0, le=100, description="how many it is judged by: the newest ones")


class ScheduleDefinition(StrictModel):
    """When a schedule is due."""

    kind: Literal["campaign", "identification", "diagnosis"] = Field(description="what is repeated")
    cron: str | None = Field(
        default=None, max_length=200, description="minute hour day month weekday", examples=["0 2 * * mon-fri"]
    )
    every_s: Annotated[int, Field(ge=10, le=366 * 86400)] | None = Field(
        default=None, description="or every so many seconds, counted from when it was set up"
    )
    timezone: Annotated[str, AfterValidator(_time_zone)] = Field(default="UTC", description="of cron and window")
    window: Window | None = Field(default=None, description="the only time in which anything is started; null: any")
    interlock: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}$")] | None = Field(
        default=None,
        description="program in the folder `interlocks` of the data folder that says whether the arm is free",
    )
    grace_s: int = Field(default=600, ge=1, le=7 * 86400, description="how late it may start; later, it is passed over")
    enabled: bool = Field(default=True, description="whether it is ever due")
    recordings: RecordingChoice | None = Field(default=None, description="of an analysis; a campaign makes its own")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.cron is None) == (self.every_s is None):
            raise PydanticCustomError("trigger", "has to have either cron or every_s")
        if (self.kind == "campaign") == (self.recordings is not None):
            text = "a campaign makes its own recordings; an identification or a diagnosis has to say which it takes"
            raise PydanticCustomError("recordings", text)
        try:
            self._trigger(datetime.now(UTC))
        except ValueError as error:
            text = "cron: {reason}; write five fields, as in 0 2 * * mon-fri"
            raise PydanticCustomError("cron", text, {"reason": str(error)}) from None
        return self

    def next_after(self, now: datetime, created: datetime) -> datetime | None:
        """When it is due next, strictly after a moment; None where it never is."""
        if not self.enabled:
            return None
        found = self._trigger(created).get_next_fire_time(None, now + timedelta(microseconds=1))
        return None if found is None else found.astimezone(UTC)

    def is_open(self, now: datetime) -> bool:
        return self.window is None or self.window.holds(now.astimezone(ZoneInfo(self.timezone)))

    def _trigger(self, created: datetime) -> BaseTrigger:
        zone = ZoneInfo(self.timezone)
        if self.cron is not None:
            return CronTrigger.from_crontab(self.cron, timezone=zone)
        return IntervalTrigger(seconds=self.every_s or 0, start_date=created, timezone=UTC)
