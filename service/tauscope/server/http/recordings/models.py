"""Answers about recordings."""

from datetime import datetime

from pydantic import Field

from tauscope.recording import EffortKind
from tauscope.server.http.robots.models import FindingAnswer
from tauscope.server.models import AnswerModel, Measured, PageAnswer
from tauscope.tasks.task import ReadingOptions


class RecordingAnswer(AnswerModel):
    """A recording that lies on the server."""

    name: str = Field(description="by which requests refer to it", examples=["log-2026-11-03.csv"])
    size: int = Field(description="number of bytes", examples=[1830221])
    modified: datetime = Field(description="when it was last written, UTC")
    sha256: str | None = Field(description="of its bytes, in hexadecimal; null in a list where it was not computed yet")
    is_damaged: bool = Field(description="whether it was sent or recorded, and its bytes are not those any more")


class RecordingListAnswer(PageAnswer):
    """Recordings on the server."""

    recordings: list[RecordingAnswer] = Field(description="by name")


class StepsAnswer(AnswerModel):
    """Steps of the clock [s]."""

    minimum: float = Field(description="shortest")
    percentile_1: float = Field(description="1 % are shorter")
    median: float = Field(description="half are shorter")
    percentile_99: float = Field(description="99 % are shorter")
    maximum: float = Field(description="longest")


class GapsAnswer(AnswerModel):
    """Steps of the clock beyond 1.9 medians."""

    count: int = Field(description="how many")
    longest: float = Field(description="the longest [s]; 0 without gaps")
    longest_at: float | None = Field(description="time at which it begins [s]")


class PeriodsAnswer(AnswerModel):
    """Repeats of the excitation."""

    count: int = Field(description="how many are marked")
    shortest: int = Field(description="samples of the shortest")
    longest: int = Field(description="samples of the longest")


class ChannelsAnswer(AnswerModel):
    """One joint's channels."""

    position: tuple[Measured, Measured] = Field(description="least and greatest value [rad or m]; null without samples")
    effort: tuple[Measured, Measured] = Field(description="least and greatest value [Nm, N or drive units]")
    position_step: float | None = Field(description="step in multiples of which the position moves [rad or m]")
    wraps: int = Field(description="jumps of the position by about 2π")
    first_wrap: Measured = Field(description="time of the first of them [s]")
    clipped: tuple[tuple[float, int], ...] = Field(
        description="levels at which the effort stays, and number of samples"
    )


class RecordingReportAnswer(AnswerModel):
    """What a recording holds, and what to look at before trusting it."""

    name: str = Field(description="of the recording")
    samples: int = Field(description="number of samples")
    duration_s: float = Field(description="from the first to the last sample [s]")
    rate_hz: float = Field(description="1 / median step [Hz]")
    effort_kind: EffortKind = Field(description="torque (tau), or drive units (i)")
    columns: tuple[str, ...] = Field(description="columns that are read")
    ignored_columns: tuple[str, ...] = Field(description="columns that nobody reads")
    missed: dict[str, int] = Field(description="number of NaN in each column that has any")
    steps: StepsAnswer = Field(description="of the clock")
    gaps: GapsAnswer = Field(description="where the clock skips")
    periods: PeriodsAnswer | None = Field(description="repeats of the excitation, where they are marked")
    joints: tuple[ChannelsAnswer, ...] = Field(description="one a joint")
    findings: tuple[FindingAnswer, ...] = Field(description="warnings first")


class ReadingRequest(ReadingOptions):
    """How a recording is to be read."""


class MappingAnswer(AnswerModel):
    """Which columns of a file are read as which."""

    header: tuple[str, ...] = Field(description="names of the file's columns; numbers from 1 where it has no names")
    columns: dict[str, str] = Field(description="the file's column for t, q1, tau1, …; only those that were found")
    units: dict[str, str] = Field(description="of t, q, qd and tau")
    is_guessed: bool = Field(description="whether only the words of the column names suggest it")


class UnderstandingAnswer(AnswerModel):
    """How a recording is understood; nothing of it is kept."""

    mapping: MappingAnswer | None = Field(description="its columns and units; null for a log, which names its joints")
    report: RecordingReportAnswer | None = Field(description="what it holds, read so; null where it is refused")
    problem: str | None = Field(description="why it is refused, and what to do")
