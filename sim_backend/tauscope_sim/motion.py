"""Random Fourier motions: band-limited, periodic, within the joints' limits. Random, not optimised for excitation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.errors import RecordingError, RobotFileError
from tauscope.robot.robot import Array, Joint

LEAST_HARMONICS = 2  # one harmonic alone cannot be at rest, with zero acceleration, at the ends of its period


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """A motion at given instants: q, q̇, q̈, each (N, n) [rad or m, and per s, per s²]."""

    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class FourierMotion:
    """A finite Fourier series a joint, the form of the paper's section 5.2 about a centre position."""

    period_s: float  # duration of one period, 2π/ω_f [s]
    centre: Array  # (n,), mean position [rad or m]
    cosine: Array  # (n, M), a_l, velocity amplitude of the cosine of harmonic l [rad/s or m/s]
    sine: Array  # (n, M), b_l, velocity amplitude of the sine of harmonic l [rad/s or m/s]

    def evaluate(self, time: Array) -> MotionSamples:
        """Exact position, velocity and acceleration. `time`: (N,), instants since the start of a period [s]."""
        omega = 2.0 * np.pi / self.period_s * np.arange(1, self.cosine.shape[1] + 1)
        phase = np.multiply.outer(time, omega)
        cosine, sine = np.cos(phase), np.sin(phase)
        return MotionSamples(
            position=self.centre + sine @ (self.cosine / omega).T - cosine @ (self.sine / omega).T,
            velocity=cosine @ self.cosine.T + sine @ self.sine.T,
            acceleration=cosine @ (self.sine * omega).T - sine @ (self.cosine * omega).T,
        )


def random_fourier_motion(
    joints: Sequence[Joint],
    rng: np.random.Generator,
    *,
    period_s: float = 10.0,
    harmonics: int = 5,
    limit_fraction: float = 0.95,
) -> FourierMotion:
    """Random finite Fourier series, each joint scaled until the first of its limits is reached, at every instant.

    Velocity and acceleration are zero at both ends of the period of `period_s` [s]: Σ a_l = 0 and Σ l b_l = 0. Raises
    RobotFileError where a joint states no limit, RecordingError for an argument out of its range.
    """
    if not (np.isfinite(period_s) and period_s > 0.0):
        raise RecordingError(f"period_s is {period_s}; give a positive duration")
    if harmonics < LEAST_HARMONICS:
        raise RecordingError(
            f"harmonics is {harmonics}; a motion that rests at its ends needs at least {LEAST_HARMONICS}"
        )
    if not 0.0 < limit_fraction <= 1.0:
        raise RecordingError(f"limit_fraction is {limit_fraction}; give a number above 0 and up to 1")
    order = np.arange(1, harmonics + 1)
    cosine = rng.standard_normal((len(joints), harmonics))
    cosine -= cosine.mean(axis=1, keepdims=True)
    sine = rng.standard_normal((len(joints), harmonics))
    sine -= np.multiply.outer(sine @ order, order) / (order @ order)
    shape = FourierMotion(period_s, np.zeros(len(joints)), cosine, sine)
    return _fit_into_limits(shape, joints, limit_fraction, rng)


def _fit_into_limits(
    shape: FourierMotion, joints: Sequence[Joint], limit_fraction: float, rng: np.random.Generator
) -> FourierMotion:
    harmonics = shape.cosine.shape[1]
    count = 64 * harmonics
    samples = shape.evaluate(np.arange(count) * (shape.period_s / count))
    # Between samples a trigonometric polynomial of degree M exceeds the largest of K equispaced samples by at most
    # 1/cos(π M / K) (Ehlich and Zeller): the limits hold everywhere.
    between = 1.0 / np.cos(np.pi * harmonics / count)
    middle = 0.5 * (samples.position.max(axis=0) + samples.position.min(axis=0))
    reach = between * np.abs(samples.position - middle).max(axis=0)
    speed = between * np.abs(samples.velocity).max(axis=0)
    acceleration = between * np.abs(samples.acceleration).max(axis=0)
    scale, centre = np.empty(len(joints)), np.zeros(len(joints))
    for column, joint in enumerate(joints):
        scale[column] = limit_fraction * _largest_scale(joint, reach[column], speed[column], acceleration[column])
        if joint.limits.position is not None:
            low, high = joint.limits.position
            half_room = 0.5 * limit_fraction * (high - low) - scale[column] * reach[column]
            centre[column] = 0.5 * (low + high) + half_room * rng.uniform(-1.0, 1.0)
    return FourierMotion(
        period_s=shape.period_s,
        centre=centre - scale * middle,
        cosine=shape.cosine * scale[:, None],
        sine=shape.sine * scale[:, None],
    )


def _largest_scale(joint: Joint, reach: float, speed: float, acceleration: float) -> float:
    limits = joint.limits
    half_range = None if limits.position is None else 0.5 * (limits.position[1] - limits.position[0])
    stated = ((half_range, reach), (limits.velocity, speed), (limits.acceleration, acceleration))
    factors = [limit / most for limit, most in stated if limit is not None]
    if not factors:
        raise RobotFileError(
            f"joint {joint.name}: limits states neither position, velocity nor acceleration; state one to make a motion"
        )
    return min(factors)
