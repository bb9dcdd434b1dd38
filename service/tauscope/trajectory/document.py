"""A trajectory as a document, schema ``tauscope.trajectory/1``: exact coefficients, so that it reads back as it was."""

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from tauscope.errors import ExcitationError
from tauscope.robot.robot import Array
from tauscope.strict_model import take_fields
from tauscope.trajectory.fourier_series import FourierSeries, MotionSamples
from tauscope.trajectory.limits import MotionLimits
from tauscope.trajectory.segments import FourierSegment, MoveSegment, PathSegment, SampledSegment, Segment
from tauscope.trajectory.trajectory import DesignRecord, Trajectory

Vector = list[float]
Matrix = list[list[float]]

SCHEMA = "tauscope.trajectory/1"


class TrajectoryPart(BaseModel):
    """Base of the document's parts: strict, closed to unknown keys, finite numbers only."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=True)


class SeriesEntry(TrajectoryPart):
    """A finite Fourier series a joint: velocity = Σ_l cosine[l] cos(2π l t/T) + sine[l] sin(2π l t/T)."""

    period_s: float = Field(gt=0.0, description="T [s]")
    centre: Vector = Field(description="mean position [rad or m], one a joint")
    cosine: Matrix = Field(description="velocity amplitudes a_l [rad/s or m/s], one row a joint")
    sine: Matrix = Field(description="velocity amplitudes b_l [rad/s or m/s], one row a joint")


class FourierEntry(SeriesEntry):
    """Whole periods of a Fourier series."""

    kind: Literal["fourier"] = Field(default="fourier", description="which kind of segment it is")
    repeats: int = Field(ge=1, le=100_000, description="how often the period is played")
    first_period: int | None = Field(description="index of the first repeat in column `period`; null: not counted")


class PathEntry(TrajectoryPart):
    """A minimum-jerk move along the path of a Fourier series."""

    kind: Literal["path"] = Field(default="path", description="which kind of segment it is")
    series: SeriesEntry = Field(description="the path")
    from_s: float = Field(description="instant of the series at which it begins [s]")
    to_s: float = Field(description="instant of the series at which it ends [s]")
    duration_s: float = Field(gt=0.0, description="how long it takes [s]")


class MoveEntry(TrajectoryPart):
    """A straight minimum-jerk move."""

    kind: Literal["move"] = Field(default="move", description="which kind of segment it is")
    start: Vector = Field(description="posture [rad or m]")
    end: Vector = Field(description="posture [rad or m]")
    duration_s: float = Field(gt=0.0, description="how long it takes [s]")


class SampledEntry(TrajectoryPart):
    """A motion given by samples."""

    kind: Literal["sampled"] = Field(default="sampled", description="which kind of segment it is")
    time: Vector = Field(description="instants from 0 [s]")
    position: Matrix = Field(description="one row a sample [rad or m]")
    velocity: Matrix = Field(description="one row a sample [rad/s or m/s]")
    acceleration: Matrix = Field(description="one row a sample [rad/s² or m/s²]")
    period: list[float | None] | None = Field(
        default=None, description="period index from each sample on; null outside"
    )


SegmentEntry = Annotated[FourierEntry | PathEntry | MoveEntry | SampledEntry, Field(discriminator="kind")]


class LimitsEntry(TrajectoryPart):
    """Limits that the trajectory was made to keep, one number a joint."""

    position_low: Vector = Field(description="[rad or m]")
    position_high: Vector = Field(description="[rad or m]")
    velocity: Vector = Field(description="[rad/s or m/s]")
    acceleration: Vector = Field(description="[rad/s² or m/s²]")
    torque: list[float | None] = Field(description="[Nm or N]; null where none is stated")
    assumed: list[str] = Field(default_factory=list, description="limits that the robot file does not state")


class TrajectoryDocument(TrajectoryPart):
    """A trajectory file."""

    schema_: Literal["tauscope.trajectory/1"] = Field(
        default=SCHEMA, alias="schema", description="name and version of this form"
    )
    robot: str = Field(description="name of the robot that it was made for")
    joints: list[str] = Field(min_length=1, description="names of the joints, base first")
    limits: LimitsEntry | None = Field(default=None, description="null where nobody knows")
    design: DesignRecord | None = Field(default=None, description="null for a motion from elsewhere")
    segments: list[SegmentEntry] = Field(min_length=1, description="the pieces in order, each at rest at both ends")


def trajectory_document(trajectory: Trajectory) -> TrajectoryDocument:
    """The document of a trajectory."""
    limits, entry = trajectory.limits, None
    if limits is not None:
        torque = [float(value) if np.isfinite(value) else None for value in limits.torque]
        entry = take_fields(LimitsEntry, limits, torque=torque)
    segments = [_segment_entry(segment) for segment in trajectory.segments]
    return take_fields(TrajectoryDocument, trajectory, limits=entry, segments=segments)


def trajectory_of(document: TrajectoryDocument) -> Trajectory:
    """The trajectory that a document describes. Raises ExcitationError naming the key."""
    joints = len(document.joints)
    segments = tuple(_segment_of(entry, joints, f"segments[{place}]") for place, entry in enumerate(document.segments))
    limits = None if document.limits is None else _limits_of(document.limits, joints)
    return Trajectory(document.robot, tuple(document.joints), segments, limits, document.design)


def _series_entry(series: FourierSeries) -> SeriesEntry:
    return take_fields(SeriesEntry, series, period_s=float(series.period_s))


def _segment_entry(segment: Segment) -> FourierEntry | PathEntry | MoveEntry | SampledEntry:
    if isinstance(segment, FourierSegment):
        series = _series_entry(segment.series).model_dump()
        return FourierEntry(repeats=segment.repeats, first_period=segment.first_period, **series)
    if isinstance(segment, PathSegment):
        series = _series_entry(segment.series)
        return take_fields(PathEntry, segment, series=series)
    if isinstance(segment, MoveSegment):
        return take_fields(MoveEntry, segment)
    if isinstance(segment, SampledSegment):
        label = segment.label
        period = None if label is None else [None if np.isnan(value) else float(value) for value in label]
        return take_fields(SampledEntry, segment.motion, time=segment.time.tolist(), period=period)
    raise ExcitationError(f"a segment of kind {type(segment).__name__} has no place in a trajectory file")


def _segment_of(entry: FourierEntry | PathEntry | MoveEntry | SampledEntry, joints: int, key: str) -> Segment:
    if isinstance(entry, FourierEntry):
        return FourierSegment(_series_of(entry, joints, key), entry.repeats, entry.first_period)
    if isinstance(entry, PathEntry):
        series = _series_of(entry.series, joints, f"{key}.series")
        return PathSegment(series, entry.from_s, entry.to_s, entry.duration_s)
    if isinstance(entry, MoveEntry):
        start, end = (_array(getattr(entry, name), (joints,), f"{key}.{name}") for name in ("start", "end"))
        return MoveSegment(start, end, entry.duration_s)
    return _make_sampled(entry, joints, key)


def _make_sampled(entry: SampledEntry, joints: int, key: str) -> SampledSegment:
    count = len(entry.time)
    names = ("position", "velocity", "acceleration")
    position, velocity, acceleration = (_array(getattr(entry, n), (count, joints), f"{key}.{n}") for n in names)
    label = None
    if entry.period is not None:
        values = [np.nan if value is None else value for value in entry.period]
        label = _array(values, (count,), f"{key}.period")
    try:
        return SampledSegment(np.array(entry.time), MotionSamples(position, velocity, acceleration), label)
    except ExcitationError as error:
        raise ExcitationError(f"{key}.time: {error}") from None


def _series_of(entry: SeriesEntry, joints: int, key: str) -> FourierSeries:
    centre = _array(entry.centre, (joints,), f"{key}.centre")
    harmonics = len(entry.cosine[0]) if entry.cosine else 0
    if harmonics == 0:
        raise ExcitationError(f"{key}.cosine: holds no coefficients; give one row a joint, one number a harmonic")
    cosine, sine = (_array(getattr(entry, n), (joints, harmonics), f"{key}.{n}") for n in ("cosine", "sine"))
    return FourierSeries(entry.period_s, centre, cosine, sine)


def _limits_of(entry: LimitsEntry, joints: int) -> MotionLimits:
    names = ("position_low", "position_high", "velocity", "acceleration")
    low, high, velocity, acceleration = (_array(getattr(entry, n), (joints,), f"limits.{n}") for n in names)
    torque = _array([np.inf if value is None else value for value in entry.torque], (joints,), "limits.torque")
    return MotionLimits(low, high, velocity, acceleration, torque, tuple(entry.assumed))


def _array(values: Sequence[float] | Sequence[Sequence[float]], shape: tuple[int, ...], key: str) -> Array:
    """Numbers as an array of the expected shape."""
    if len(values) != shape[0]:
        raise ExcitationError(f"{key}: has {len(values)} entries where {shape[0]} are expected")
    if len(shape) == 2:
        for row, entries in enumerate(values):
            found = len(entries) if isinstance(entries, Sequence) else 1
            if found != shape[1]:
                raise ExcitationError(f"{key}[{row}]: has {found} numbers where {shape[1]} are expected")
    return np.array(values, dtype=np.float64).reshape(shape)


EXCITATION_SCHEMA = "tauscope.excitation/1"


class HistoryPart(TrajectoryPart):
    """One iteration of the optimiser."""

    start: int = Field(description="from which start, counted from 1")
    iteration: int = Field(description="of this round, counted from 1")
    value: float = Field(description="criterion as the optimiser saw it, friction's sign smoothed")
    violation: float = Field(description="largest violation of a constraint, as part of the limit; 0: all are kept")


class ExcitationDocument(TrajectoryPart):
    """A designed excitation."""

    schema_: Literal["tauscope.excitation/1"] = Field(
        default=EXCITATION_SCHEMA, alias="schema", description="name and version of this form"
    )
    robot: str = Field(description="name of the robot")
    joints: list[str] = Field(description="names of the joints, base first")
    criterion: Literal["cond-f", "log-det", "cond-2"] = Field(description="what was minimised")
    value: float = Field(description="the criterion for one period")
    condition_number: float = Field(description="of the stacked, unweighted regressor of one period, SI units")
    random_value: float = Field(description="the criterion of the best random motion that the optimiser began with")
    period_s: float = Field(description="duration of one period [s]")
    harmonics: int = Field(description="number of harmonics")
    periods: int = Field(description="how often the period is repeated")
    duration_s: float = Field(description="duration of the whole trajectory [s]")
    margins: dict[str, list[float | None]] = Field(
        description="part of each kind of limit that is left, one a joint; null where there is no limit"
    )
    clearance_m: float | None = Field(
        description="smallest clearance of joint origins and tool [m]; null where nothing is forbidden"
    )
    active: list[str] = Field(description="limits that keep the criterion from getting better")
    notes: list[str] = Field(description="what was assumed or could not be done")
    evaluations: int = Field(description="motions whose criterion was computed")
    seconds: float = Field(description="time that the optimiser took [s]")
    history: list[HistoryPart] = Field(description="every iteration")
    trajectory: TrajectoryDocument = Field(description="what a run plays, schema tauscope.trajectory/1")
