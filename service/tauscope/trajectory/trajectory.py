"""A trajectory: what a run plays and what trajectory files hold."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydantic import ConfigDict, Field

from tauscope.errors import ExcitationError
from tauscope.robot.robot import Array
from tauscope.strict_model import StrictModel
from tauscope.trajectory.fourier_series import MotionSamples
from tauscope.trajectory.limits import MotionLimits
from tauscope.trajectory.segments import (
    PEAK_ACCELERATION,
    PEAK_SPEED,
    FourierSegment,
    MoveSegment,
    SampledSegment,
    Segment,
)

JOIN_TOLERANCE = 1e-9  # largest jump between segments that rounding explains [rad or m, and per s, per s²]

# Speed and acceleration at the ends of a motion given by samples that still count as rest [rad/s, rad/s²].
SAMPLED_REST = 1e-3
RAMP_FRACTION = 0.5  # part of the velocity and acceleration limits that a ramp uses: nobody has seen this motion before
SHORTEST_RAMP_S = 0.5  # a ramp lasts at least this long, also where there is no way to go [s]
TIME_STEP_S = 0.01  # durations of moves are a whole number of these [s]
MOST_SAMPLES = 50_000_000  # samples beyond which the asked rate must be a mistake


@dataclass(frozen=True, eq=False)
class TrajectorySamples:
    """A trajectory at instants `time`, (N,) [s]: q, q̇, q̈, (N, n) [rad or m, and per s, per s²]."""

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    period: Array  # (N,), index of the repeated excitation period, counted from 0; NaN outside the repeated part


class DesignRecord(StrictModel):
    """How the trajectory was made."""

    model_config = ConfigDict(allow_inf_nan=False)

    criterion: str = Field(description="what was minimised")
    value: float = Field(description="its value")
    condition_number: float = Field(description="of the stacked, unweighted regressor of the repeated part")
    margins: dict[str, list[float | None]] = Field(
        description="part of each kind of limit that is left, one a joint; null where there is no limit"
    )
    seed: int = Field(description="of the optimiser's starts")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion of all joints, piece after piece, twice continuously differentiable, at rest at both ends."""

    robot: str
    joints: tuple[str, ...]
    segments: tuple[Segment, ...]
    limits: MotionLimits | None = None  # limits that it was made to keep; None where nobody knows
    design: DesignRecord | None = None  # how it was made; None for a motion from elsewhere

    def __post_init__(self) -> None:
        """Refuse pieces that do not make one motion of these joints."""
        if not self.segments:
            raise ExcitationError("a trajectory needs at least one segment")
        for place, segment in enumerate(self.segments):
            if segment.joint_count != len(self.joints):
                raise ExcitationError(
                    f"segments[{place}] moves {segment.joint_count} joints, the trajectory names {len(self.joints)}"
                )
            if not (np.isfinite(segment.duration_s) and segment.duration_s > 0.0):
                raise ExcitationError(f"segments[{place}] lasts {segment.duration_s} s; give a positive duration")
        _require_joined(self.segments, self.joints)

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return len(self.joints)

    @property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        return float(sum(segment.duration_s for segment in self.segments))

    @property
    def start(self) -> Array:
        """Posture in which it begins [rad or m], shape (n,)."""
        return self.segments[0].evaluate(np.zeros(1)).position[0]

    @property
    def end(self) -> Array:
        """Posture in which it ends [rad or m], shape (n,)."""
        last = self.segments[-1]
        return last.evaluate(np.array([last.duration_s])).position[0]

    @property
    def period_s(self) -> float | None:
        """Length of the repeated period [s]; None where nothing repeats."""
        lengths = (s.series.period_s for s in self.segments if isinstance(s, FourierSegment) and s.repeats > 1)
        return next(lengths, None)

    def samples(self, rate_hz: float) -> TrajectorySamples:
        """Samples at k / rate until the motion has ended. Raises ExcitationError for an absurd rate."""
        return self.evaluate(np.arange(self.count_samples(rate_hz)) / rate_hz)

    def count_samples(self, rate_hz: float) -> int:
        """How many samples it has at a rate. Raises ExcitationError for one that is absurd."""
        if not (np.isfinite(rate_hz) and rate_hz > 0.0):
            raise ExcitationError(f"the sampling rate is {rate_hz} Hz; give a positive number")
        count = self.duration_s * rate_hz
        if count > MOST_SAMPLES:
            raise ExcitationError(
                f"{self.duration_s:.4g} s at {rate_hz:.4g} Hz are {count:.2g} samples; ask for a lower rate"
            )
        return int(np.ceil(count - 1e-6)) + 1

    def evaluate(self, time: Array) -> TrajectorySamples:
        """The trajectory at `time`, (N,), ascending [s]; before its start and after its end it stands still."""
        shape = (len(time), self.joint_count)
        result = TrajectorySamples(time, np.empty(shape), np.empty(shape), np.empty(shape), np.full(len(time), np.nan))
        starts = np.concatenate([[0.0], np.cumsum([segment.duration_s for segment in self.segments])])
        # An instant that rounding puts before a segment's start belongs to that segment.
        edges = np.searchsorted(time, starts - 1e-9 * max(1.0, self.duration_s))
        edges[0], edges[-1] = 0, len(time)
        for segment, begin, (first, last) in zip(self.segments, starts, pairwise(edges), strict=False):
            local = np.clip(time[first:last] - begin, 0.0, segment.duration_s)
            motion = segment.evaluate(local)
            result.position[first:last] = motion.position
            result.velocity[first:last] = motion.velocity
            result.acceleration[first:last] = motion.acceleration
            result.period[first:last] = segment.period(local)
        slack = 1e-9 * max(1.0, self.duration_s)
        beyond = (time < -slack) | (time > self.duration_s + slack)
        result.velocity[beyond], result.acceleration[beyond] = 0.0, 0.0
        result.period[beyond | (time > self.duration_s - slack)] = np.nan  # the end is the next period's first instant
        return result


def ramp(start: Array, end: Array, limits: MotionLimits, *, fraction: float = RAMP_FRACTION) -> MoveSegment:
    """A straight minimum-jerk move from `start` to `end`, (n,), within the limits of velocity and acceleration.

    Between postures within the position limits all of it is. Raises ExcitationError for a posture that is none.
    """
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    joints = len(limits.velocity)
    if start.shape != (joints,) or end.shape != (joints,) or not (np.isfinite(start) & np.isfinite(end)).all():
        raise ExcitationError(f"a ramp goes between two finite postures of {joints} joints; read the arm again")
    way = np.abs(end - start)
    by_speed = PEAK_SPEED * way / (fraction * limits.velocity)
    by_acceleration = np.sqrt(PEAK_ACCELERATION * way / (fraction * limits.acceleration))
    shortest = max(SHORTEST_RAMP_S, by_speed.max(), by_acceleration.max())
    return MoveSegment(start, end, whole_steps(float(shortest)))


def whole_steps(duration_s: float) -> float:
    """A duration rounded up to `TIME_STEP_S`, so that what follows begins at a sample of all usual rates."""
    steps_a_second = round(1.0 / TIME_STEP_S)
    return float(np.ceil(duration_s * steps_a_second - 1e-9) / steps_a_second)


def _require_joined(segments: tuple[Segment, ...], joints: tuple[str, ...]) -> None:
    """Each piece begins where the one before ended, and all rest where they meet."""
    previous: MotionSamples | None = None
    for place, segment in enumerate(segments):
        ends = segment.evaluate(np.array([0.0, segment.duration_s]))
        size = 1.0 + np.abs(ends.position).max()
        for values, what, unit in ((ends.velocity, "velocity", "1/s"), (ends.acceleration, "acceleration", "1/s²")):
            rest = np.abs(values)
            if not (rest <= _rest_tolerance(segment, size)).all():
                side, joint = (int(i) for i in np.argwhere(~(rest <= _rest_tolerance(segment, size)))[0])
                raise ExcitationError(
                    f"segments[{place}], {joints[joint]}: {what} is {values[side, joint]:.3g} {unit} at its "
                    f"{('start', 'end')[side]}; every segment has to begin and end at rest"
                )
        if previous is not None:
            jump = np.abs(ends.position[0] - previous.position[1])
            if not (jump <= JOIN_TOLERANCE * size).all():
                joint = int(np.argmax(~(jump <= JOIN_TOLERANCE * size)))
                raise ExcitationError(
                    f"segments[{place}], {joints[joint]}: begins {jump[joint]:.3g} away from where "
                    f"segments[{place - 1}] ends; let them meet"
                )
        previous = ends


def _rest_tolerance(segment: Segment, size: float) -> float:
    """Speed and acceleration that rounding leaves at the ends of a segment."""
    if isinstance(segment, FourierSegment):
        top = float(segment.series.frequencies[-1])
        amplitude = float(np.abs(segment.series.cosine).sum() + np.abs(segment.series.sine).sum())
        return JOIN_TOLERANCE * (1.0 + top) * (1.0 + amplitude)
    return SAMPLED_REST if isinstance(segment, SampledSegment) else JOIN_TOLERANCE * size
