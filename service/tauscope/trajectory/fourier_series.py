"""Finite Fourier series of the joint positions: the form of excitation of the seed paper's section 5.2."""

from dataclasses import dataclass

import numpy as np

from tauscope.errors import ExcitationError
from tauscope.robot.robot import Array

LEAST_HARMONICS = 2  # one harmonic alone cannot be at rest, with zero acceleration, at the ends of its period


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """q, q̇, q̈ at given instants, (N, n) each [rad or m, and per s, per s²]."""

    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class FourierSeries:
    """q̇_i(t) = Σ_l a_l cos(ω_f l t) + b_l sin(ω_f l t), M harmonics of ω_f = 2π/T: the seed paper's section 5.2."""

    period_s: float  # fundamental period T [s]
    centre: Array  # (n,), mean position [rad or m]
    cosine: Array  # (n, M), a_l, velocity amplitude of the cosine of harmonic l [rad/s or m/s]
    sine: Array  # (n, M), b_l, velocity amplitude of the sine of harmonic l [rad/s or m/s]

    def __post_init__(self) -> None:
        """Refuse arrays that do not belong together."""
        if not (np.isfinite(self.period_s) and self.period_s > 0.0):
            raise ExcitationError(f"the period is {self.period_s} s; give a positive duration")
        joints = len(self.centre)
        if self.cosine.shape != self.sine.shape or self.cosine.ndim != 2 or len(self.cosine) != joints:
            raise ExcitationError(
                f"Fourier coefficients of shapes {self.cosine.shape} and {self.sine.shape} do not fit {joints} joints; "
                "give one row a joint and one column a harmonic in both"
            )

    @property
    def joint_count(self) -> int:
        """Number of joints n."""
        return len(self.centre)

    @property
    def harmonics(self) -> int:
        """Number of harmonics M."""
        return self.cosine.shape[1]

    @property
    def frequencies(self) -> Array:
        """ω_f l of every harmonic [rad/s], shape (M,)."""
        return 2.0 * np.pi / self.period_s * np.arange(1.0, self.harmonics + 1.0)

    def evaluate(self, time: Array) -> MotionSamples:
        """Exact position, velocity and acceleration. `time`: (N,), instants since the start of a period [s]."""
        omega = self.frequencies
        phase = np.multiply.outer(time, omega)
        cosine, sine = np.cos(phase), np.sin(phase)
        return MotionSamples(
            position=self.centre + sine @ (self.cosine / omega).T - cosine @ (self.sine / omega).T,
            velocity=cosine @ self.cosine.T + sine @ self.sine.T,
            acceleration=cosine @ (self.sine * omega).T - sine @ (self.cosine * omega).T,
        )


def between_samples(harmonics: int, samples: int) -> float:
    """Factor 1/cos(π M / K) by which degree M may exceed its largest of K > 2 M samples (Ehlich and Zeller)."""
    if samples <= 2 * harmonics:
        raise ExcitationError(f"{samples} samples a period cannot bound {harmonics} harmonics; take more samples")
    return float(1.0 / np.cos(np.pi * harmonics / samples))
