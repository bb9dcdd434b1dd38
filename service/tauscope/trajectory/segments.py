"""The pieces that a trajectory is made of.

Each begins and ends at rest with zero acceleration: any two that share a posture join twice continuously
differentiable.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from tauscope.errors import ExcitationError
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import FourierSeries, MotionSamples

PEAK_SPEED = 1.875  # largest speed of the minimum-jerk move over distance and duration one
PEAK_ACCELERATION = 10.0 / np.sqrt(3.0)  # largest acceleration of the minimum-jerk move over distance and duration one


class Segment(ABC):
    """A piece of a trajectory."""

    duration_s: float  # how long it lasts [s]

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return self.evaluate(np.zeros(1)).position.shape[1]

    @abstractmethod
    def evaluate(self, time: Array) -> MotionSamples:
        """Exact position, velocity and acceleration. `time`: (N,), instants since its start [s]."""

    def period(self, time: Array) -> Array:
        """Index of the repeated excitation period, (N,), NaN outside; `time`: (N,) since its start [s]."""
        return np.full(len(time), np.nan)


@dataclass(frozen=True, eq=False)
class FourierSegment(Segment):
    """Whole periods of a Fourier series; `first_period` counts in column `period`, None where not to be counted."""

    series: FourierSeries
    repeats: int = 1
    first_period: int | None = None

    @property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        return self.repeats * self.series.period_s

    def evaluate(self, time: Array) -> MotionSamples:
        """Exact position, velocity and acceleration. `time`: (N,), instants since its start [s]."""
        return self.series.evaluate(time)

    def period(self, time: Array) -> Array:
        """Index of the repeat, shape (N,). `time`: (N,), instants since its start [s]."""
        if self.first_period is None:
            return np.full(len(time), np.nan)
        # Rounding of the instants must not put the first sample of a period into the one before.
        repeat = np.floor(time / self.series.period_s + 1e-9)
        return self.first_period + np.clip(repeat, 0, self.repeats - 1)


@dataclass(frozen=True, eq=False)
class MoveSegment(Segment):
    """A minimum-jerk move between postures (n,): q = q_0 + (q_1 - q_0)(10 s³ - 15 s⁴ + 6 s⁵), s = t/T."""

    start: Array
    end: Array
    duration_s: float  # T [s]

    def evaluate(self, time: Array) -> MotionSamples:
        """Exact position, velocity and acceleration. `time`: (N,), instants since its start [s]."""
        progress, rate, bend = minimum_jerk(time, self.duration_s)
        way = self.end - self.start
        # The last sample is the end itself, not the end but for rounding.
        from_end = progress[:, None] > 0.5
        position = np.where(from_end, self.end - (1.0 - progress)[:, None] * way, self.start + progress[:, None] * way)
        return MotionSamples(position, rate[:, None] * way, bend[:, None] * way)


@dataclass(frozen=True, eq=False)
class PathSegment(Segment):
    """A move along a series' path at a pace of its own: q = F(σ(t)), σ minimum-jerk; it visits no other posture."""

    series: FourierSeries
    from_s: float  # instant of the series at which it begins [s]
    to_s: float  # instant of the series at which it ends [s]
    duration_s: float  # how long it takes [s]

    def evaluate(self, time: Array) -> MotionSamples:
        """Exact q, q̇ = F' σ̇, q̈ = F'' σ̇² + F' σ̈; `time`: (N,) since its start [s]."""
        progress, rate, bend = minimum_jerk(time, self.duration_s)
        way = self.to_s - self.from_s
        sigma = np.where(progress > 0.5, self.to_s - (1.0 - progress) * way, self.from_s + progress * way)
        path = self.series.evaluate(sigma)
        pace, change = (way * rate)[:, None], (way * bend)[:, None]
        return MotionSamples(path.position, path.velocity * pace, path.acceleration * pace**2 + path.velocity * change)


@dataclass(frozen=True, eq=False)
class SampledSegment(Segment):
    """Samples and the quintics between them; `label`: (K,), period from each sample on, NaN outside."""

    time: Array  # (K,), instants of the samples, from 0, increasing [s]
    motion: MotionSamples
    label: Array | None = None

    def __post_init__(self) -> None:
        """Refuse samples that are no motion."""
        if len(self.time) < 2 or self.time[0] != 0.0 or not (np.diff(self.time) > 0.0).all():
            raise ExcitationError("a sampled motion needs two or more instants that increase from 0")

    @property
    def duration_s(self) -> float:
        """How long it lasts [s]."""
        return float(self.time[-1])

    def evaluate(self, time: Array) -> MotionSamples:
        """Motion by the quintics, the samples themselves at their instants; `time`: (N,) since its start [s]."""
        left = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.time) - 2)
        width = (self.time[left + 1] - self.time[left])[:, None]
        share = (np.clip(time, 0.0, self.time[-1]) - self.time[left])[:, None] / width
        ends = [
            (values[left + side] * width**order)
            for order, values in enumerate((self.motion.position, self.motion.velocity, self.motion.acceleration))
            for side in (0, 1)
        ]
        orders = (_quintic(share, ends, order) / width**order for order in range(3))
        return MotionSamples(*orders)

    def period(self, time: Array) -> Array:
        """The label of the sample before each instant, shape (N,). `time`: (N,), instants since its start [s]."""
        if self.label is None:
            return np.full(len(time), np.nan)
        slack = 1e-9 * max(self.duration_s, 1.0)
        return self.label[np.clip(np.searchsorted(self.time, time + slack, side="right") - 1, 0, len(self.label) - 1)]


def minimum_jerk(time: Array, duration_s: float) -> tuple[Array, Array, Array]:
    """Progress 10 s³ - 15 s⁴ + 6 s⁵ from 0 to 1, its rate and the rate's rate, (N,); s = `time`/T, (N,)."""
    s = np.clip(time / duration_s, 0.0, 1.0)
    progress = s**3 * (10.0 + s * (6.0 * s - 15.0))
    rate = 30.0 * (s * (1.0 - s)) ** 2 / duration_s
    bend = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration_s**2
    return progress, rate, bend


def _quintic(s: Array, ends: list[Array], order: int) -> Array:
    """Derivative of the Hermite quintic by s; `ends` are q, q̇, q̈ at both sides, each per unit of s."""
    q0, q1, v0, v1, a0, a1 = ends
    rise = q1 - q0
    c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * rise - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
    if order == 0:
        return q0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    if order == 1:
        return v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))
    return a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))
