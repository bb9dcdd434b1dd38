"""What an effect is made from: the arm with its ranges of motion, and the signals of one piece of motion."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from tauscope.recording.conditioning.filters import derivative, smooth
from tauscope.recording.recording import Array
from tauscope.robot import Robot

T = TypeVar("T")
# Rms of a joint's rigid-body torque relative to its largest torque below which nothing presses its transmission.
LEAST_LOAD = 0.02
ONE_WAY = 0.1  # speed the other way, relative to the rms, below which a joint does not reverse


@dataclass(frozen=True, eq=False)
class ArmContext:
    """The arm and the ranges of its recorded motion."""

    robot: Robot
    slowest: Array  # (n,), of every joint's velocity, the rarest percents left out [rad/s or m/s]
    fastest: Array  # (n,)
    lowest: Array  # (n,), of every joint's position [rad or m]
    highest: Array  # (n,)
    speed: Array  # (n,), rms of every joint's velocity [rad/s or m/s]
    top_speed: Array  # (n,), its largest magnitude
    load: Array  # (n,), rms of the fitted rigid-body torque [Nm or N]
    top_torque: Array  # (n,), largest magnitude of the model's torque [Nm or N]
    # (n,), mean of every joint's inertia with all that it carries, zero where the fit knows of none [kg m² or kg]
    inertia: Array
    durations: tuple[float, ...]  # length of every training recording [s]
    cutoff_hz: float  # highest frequency that torque and columns share [Hz]
    # (n,) or None, noise of every joint's position, its encoder's steps included [rad or m]; None where it is
    # negligible
    position_std: Array | None = None
    # (n,), of every joint's recorded temperature [°C]; NaN where there is none
    coldest: Array = field(default_factory=lambda: np.zeros(0))
    hottest: Array = field(default_factory=lambda: np.zeros(0))  # (n,)
    # joints, from 0, whose transmission an encoder on the link has shown as it is
    link_encoders: frozenset[int] = frozenset()

    @property
    def joints(self) -> range:
        """Indices of the joints that move."""
        return range(self.robot.joint_count)

    def moves(self, joint: int) -> bool:
        return bool(self.highest[joint] > self.lowest[joint] and self.speed[joint] > 0.0)

    def reverses(self, joint: int) -> bool:
        """Whether a joint moves both ways."""
        return bool(
            self.slowest[joint] < -ONE_WAY * self.speed[joint] and self.fastest[joint] > ONE_WAY * self.speed[joint]
        )

    def warming(self, joint: int) -> float:
        """Range of a joint's recorded temperature [K]; zero where there is none."""
        return float(np.nan_to_num(self.hottest[joint] - self.coldest[joint])) if self.hottest.size else 0.0

    def is_loaded(self, joint: int) -> bool:
        """Whether the rigid body loads a joint's transmission at all."""
        return bool(self.load[joint] > LEAST_LOAD * self.top_torque[joint])


@dataclass(frozen=True, eq=False)
class Signals:
    """One piece of conditioned motion at the recorded rate, samples last, with the fitted model's torque."""

    robot: Robot
    rate_hz: float  # sampling rate [Hz]
    time: Array  # (P, N), instants of every repetition, from the beginning of the recording [s]
    recording: int  # index of the recording, from 0; held-out recordings have negative ones
    position: Array  # (n, N), q; as are q̇, q̈
    velocity: Array
    acceleration: Array
    load: Array  # (n, N), fitted torque of the rigid body, which the transmission carries [Nm or N]
    torque: Array  # (n, N), fitted torque of the whole model [Nm or N]
    step: Array  # (n, N), A(K_v q̇), the smooth sign of the velocity
    steepness: Array  # (n,), K_v [s/rad or s/m]
    # (10 n,), standard parameters that stand for the fitted base parameters: all that torque along this chain needs
    bodies: Array
    # (10 n,), standard parameters of the nearest physically consistent links, for another chain or another gravity
    links: Array
    periodic: bool
    # (n, P, N) or None, recorded temperature [°C]; NaN at joints without, None where none was recorded
    temperature: Array | None = None
    of_motion: dict[str, Any] = field(default_factory=dict, repr=False)
    _memory: dict[str, Any] = field(default_factory=dict, repr=False)

    def remembered(self, name: str, make: Callable[[], T]) -> T:
        """What several effects need of the same piece, made once."""
        if name not in self._memory:
            self._memory[name] = make()
        return self._memory[name]

    def remembered_of_motion(self, name: str, make: Callable[[], T]) -> T:
        """What depends on the motion and not on the model, made once for all models."""
        if name not in self.of_motion:
            self.of_motion[name] = make()
        return self.of_motion[name]

    def derivative(self, values: Array) -> Array:
        """Derivative in time of `values`, (..., N): by their Fourier series where periodic, else by differences."""
        count = values.shape[-1]
        if not self.periodic:
            return _differences(values, self.rate_hz)
        rate = 2j * np.pi * np.fft.rfftfreq(count, 1.0 / self.rate_hz)
        if count % 2 == 0:
            rate[-1] = 0.0
        return np.fft.irfft(rate * np.fft.rfft(values, axis=-1), n=count, axis=-1)

    def smoothed(self, values: Array, cutoff_hz: float) -> Array:
        """`values`, (N,), without what lies above a frequency [Hz], the phase kept, (N,)."""
        if not self.periodic:
            return smooth(values[:, None], self.rate_hz, cutoff_hz)[:, 0]
        spectrum = np.fft.rfft(values)
        frequency = np.fft.rfftfreq(len(values), 1.0 / self.rate_hz)
        return np.fft.irfft(spectrum / (1.0 + (frequency / cutoff_hz) ** 8), n=len(values))


def _differences(values: Array, rate_hz: float) -> Array:
    """Central differences of eighth order, of second order at the ends."""
    rows = np.ascontiguousarray(values.reshape(-1, values.shape[-1]).T)
    slope = derivative(rows, rate_hz)
    ends = np.isnan(slope[:, :1])
    return np.where(ends, np.gradient(rows, 1.0 / rate_hz, axis=0), slope).T.reshape(values.shape)
