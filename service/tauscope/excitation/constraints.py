"""The constraints of the seed paper's (21) as parts used of a limit, exact and smooth.

Everything that may not be exceeded is a usage: |q̇| / q̇_max, the distance from the middle of the position range over
half of it, predicted over available torque, nearness to an obstacle. The motion is feasible where all usages stay
within 1 at every instant. The optimiser sees the largest usage over time through a p-norm, which is smooth, scaled by
what it is off at the present motion: (⟨u^p⟩)^{1/p} · (max u / (⟨u^p⟩)^{1/p})_present.
"""

from dataclasses import dataclass

import numpy as np

from tauscope.excitation.information import MotionGradient
from tauscope.excitation.series_space import SeriesSpace
from tauscope.excitation.torque_prediction import TorquePrediction
from tauscope.excitation.workspace import WorkspaceUsage
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples, between_samples
from tauscope.trajectory.limits import MotionLimits

POWER = 30.0  # p of the p-norm over time: the largest usages decide, yet several peaks at once have a say
# Instants a period of the highest harmonic at which kinematic limits are held: 0.3 % is left for what lies between.
SAMPLES_PER_HARMONIC = 40
# Usage below which, in random states anywhere within the limits, a constraint needs no attention while optimising.
INACTIVE = 0.8
RANDOM_STATES = 256  # states looked at for that


@dataclass(frozen=True, eq=False)
class SmoothMaximum:
    """Smooth stand-ins of the largest usages."""

    values: Array  # (C,), one a constraint
    jacobian: Array  # (C, n, columns), their derivatives by the vector x


class KinematicUsage:
    """Usage of the limits of position, velocity and acceleration: exact at every instant."""

    def __init__(self, space: SeriesSpace, limits: MotionLimits) -> None:
        samples = SAMPLES_PER_HARMONIC * space.harmonics
        self._grid = space.grid(samples)
        self._limits = limits
        # What holds at the samples with this to spare holds between them too.
        self._between = between_samples(space.harmonics, samples)
        self._slopes = (1.0 / limits.half_range, 1.0 / limits.velocity, 1.0 / limits.acceleration)

    def signed(self, x: Array) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration as parts of their limits, (K, n) each; `x`: (n, columns)."""
        motion = self._grid.motion(x)
        place = (motion.position - self._limits.middle) / self._limits.half_range
        # The bound holds for what swings about the centre; the centre itself is the same between samples.
        centre = x[:, 0]
        return (
            centre + (place - centre) * self._between,
            motion.velocity * (self._between * self._slopes[1]),
            motion.acceleration * (self._between * self._slopes[2]),
        )

    def largest(self, x: Array) -> Array:
        """Largest usage of position, velocity and acceleration at any instant, (3, n); `x`: (n, columns)."""
        return np.stack([np.abs(part).max(axis=0) for part in self.signed(x)])

    def fitted(self, x: Array, fraction: float = 1.0) -> Array:
        """The nearest series to `x`, (n, columns), within the limits: smaller amplitudes, then shifted centres."""
        place, velocity, acceleration = self.signed(x)
        swing = place - x[:, 0]
        needed = np.stack(
            [0.5 * np.ptp(swing, axis=0), np.abs(velocity).max(axis=0), np.abs(acceleration).max(axis=0)]
        ).max(axis=0)
        shrink = np.minimum(1.0, fraction / np.maximum(needed, 1e-300))
        low, high = shrink * swing.min(axis=0), shrink * swing.max(axis=0)
        fitted = x.copy()
        fitted[:, 1:] *= shrink[:, None]
        fitted[:, 0] = np.clip(x[:, 0], -fraction - low, fraction - high)
        return fitted

    def smooth(self, x: Array, scale: Array) -> SmoothMaximum:
        """Smooth largest usages of `x`, (n, columns), exact where `scale`, (3 n,), was taken."""
        joints = len(x)
        values = np.empty(3 * joints)
        jacobian = np.zeros((3 * joints, *x.shape))
        zero = np.zeros((self._grid.samples, joints))
        for kind, part in enumerate(self.signed(x)):
            rows = slice(kind * joints, (kind + 1) * joints)
            values[rows], weight = smooth_maximum(np.abs(part), scale[rows])
            weight *= np.sign(part)
            parts = [zero, zero, zero]
            parts[kind] = weight * (self._between * self._slopes[kind])
            by_x = self._grid.pull_back(MotionGradient(*parts))
            if kind == 0:
                by_x[:, 0] = weight.sum(axis=0)
            jacobian[np.arange(rows.start, rows.stop), np.arange(joints)] = by_x
        return SmoothMaximum(values, jacobian)


@dataclass(frozen=True, eq=False)
class StateUsage:
    """Usage of what depends on the whole state: predicted torque and workspace."""

    torque: TorquePrediction | None  # None where there is no prior model or no torque limit
    workspace: WorkspaceUsage | None  # None where nothing is forbidden

    @property
    def parts(self) -> list[TorquePrediction | WorkspaceUsage]:
        """Torque, then workspace, as far as they are constrained."""
        return [part for part in (self.torque, self.workspace) if part is not None]

    def usages(self, motion: MotionSamples, base: Array | None = None) -> list[Array]:
        """Usage of each part, (N, n) of torque and (N, obstacles × points); `base`: (n, m, N), where it is known."""
        return [part.usage(motion, base) for part in self.parts]

    def largest(self, motion: MotionSamples) -> float:
        """Largest usage of all, 0 where nothing is constrained."""
        return max((float(part.max()) for part in self.usages(motion)), default=0.0)

    def without_inactive(self, limits: MotionLimits, rng: np.random.Generator) -> "StateUsage":
        """Only what random states within the limits come anywhere near."""
        states = limits.random_states(RANDOM_STATES, rng)
        active = [part for part in self.parts if part.usage(states).max() > INACTIVE]
        return StateUsage(
            self.torque if self.torque in active else None, self.workspace if self.workspace in active else None
        )

    def smooth_values(self, motion: MotionSamples, base: Array, scale: Array) -> Array:
        """Smooth largest usages, (parts,), exact where `scale`, (parts,), was taken; `base`: (n, m, N)."""
        parts = self.usages(motion, base)
        return np.array([smooth_maximum(p.reshape(-1, 1), s)[0][0] for p, s in zip(parts, scale, strict=True)])

    def smooth_gradients(self, motion: MotionSamples, base: Array, scale: Array) -> list[MotionGradient]:
        """Derivatives of `smooth_values` by the motion; `base`: (n, m, N), `scale`: (parts,)."""
        gradients = []
        for part, factor in zip(self.parts, scale, strict=True):
            usage = part.usage(motion, base)
            _, weight = smooth_maximum(usage.reshape(-1, 1), factor)
            gradients.append(part.pull_back(motion, base, weight.reshape(usage.shape)))
        return gradients


def smooth_maximum(usage: Array, scale: float | Array = 1.0) -> tuple[Array, Array]:
    """The p-norm mean (C,) of `usage`, (N, C) ≥ 0, over time by `scale`, and its derivatives (N, C)."""
    top = np.maximum(usage.max(axis=0), 1e-12)
    powers = (usage / top) ** (POWER - 1.0)
    mean = np.maximum((powers * (usage / top)).mean(axis=0), 1e-300)
    values = scale * top * mean ** (1.0 / POWER)
    return values, scale * mean ** (1.0 / POWER - 1.0) * powers / len(usage)
