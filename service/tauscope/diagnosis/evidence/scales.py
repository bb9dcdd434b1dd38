"""Sizes of what is not known at a joint: torque noise, discrepancy of each kind, friction near rest."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.recording import Array

GROUPS = 3  # kinds of discrepancy: of speed, of position, of both
REST_SHARES = np.array([0.0, 0.15, 0.5, 1.0])  # share of a row's samples near rest by which a class of rows counts
REST_BOUNDS = (0.02, 0.3, 0.7)  # shares that part the classes
NOISE_SPREAD = 1.5  # standard deviation of log σ about the noise that was estimated before
REPEATED_SPREAD = 0.1  # …where repetitions of the motion tell it
REST_SPREAD = 2.0  # standard deviation of log r about…
REST = -1.0  # …friction near rest that is known to about a third of the noise
LEAST = 1e-3  # amplitude of a discrepancy, relative to what the plain model leaves, below which it is none
LIMIT = 9.0  # magnitude that no logarithm of a scale exceeds


@dataclass(frozen=True, eq=False)
class Scales:
    """Logarithms of the scales of one joint's covariance C = σ² (1 + r² c²) + Σ_g a_g² B_g B_gᵀ."""

    values: Array  # (2 + G,), log σ, log a_g of every group, log r; in units of white noise
    level: float  # rms of what the plain model leaves, white
    noise_spread: float = NOISE_SPREAD  # standard deviation of log σ about the noise that was estimated before
    finest: float = -LIMIT  # least log σ

    @staticmethod
    def start(level: float, *, repeated: bool = False, finest: float = 0.0) -> "Scales":
        """Noise as it was estimated, or as repetitions tell it, and a discrepancy of a tenth of what is left.

        `finest`: least σ, in units of white noise.
        """
        values = np.array([0.0, *[np.log(0.1 * level)] * GROUPS, REST])
        least = max(float(np.log(max(finest, np.finfo(float).tiny))), -LIMIT)
        return Scales(values, level, REPEATED_SPREAD if repeated else NOISE_SPREAD, least)

    def bounds(self) -> list[tuple[float, float]]:
        """Range of each logarithm."""
        least = float(np.log(LEAST * self.level))
        return [(self.finest, LIMIT), *[(least, least + LIMIT)] * GROUPS, (-LIMIT, LIMIT)]

    @property
    def noise(self) -> float:
        """σ, relative to white noise."""
        return float(np.exp(self.values[0]))

    def weights(self) -> Array:
        """1 / (σ² (1 + r² c²)) of each class, (K,)."""
        return self.noise**-2.0 / (1.0 + np.exp(2.0 * self.values[-1]) * REST_SHARES**2)

    def amplitudes(self, groups: NDArray[np.intp]) -> Array:
        """Amplitude of each feature, (b,), by `groups`, (b,); 1 for an error of known size, group -1."""
        return np.where(groups < 0, 1.0, np.exp(self.values[1:-1])[groups])

    def collect(self, by_class: Array, by_feature: Array, groups: NDArray[np.intp]) -> Array:
        """Slopes in the logarithms, (2 + G,), of variances `by_class`, (K,), log a `by_feature` and `groups`, (b,)."""
        rest = np.exp(2.0 * self.values[-1]) * REST_SHARES**2
        variance = self.noise**2
        of_noise = float(by_class @ (2.0 * variance * (1.0 + rest)))
        of_rest = float(by_class @ (2.0 * variance * rest))
        return np.array([of_noise, *(by_feature[groups == group].sum() for group in range(GROUPS)), of_rest])

    def penalty(self) -> float:
        """-log p of the scales: a discrepancy is hardly larger than what the plain model leaves."""
        noise, rest = self.values[0] / self.noise_spread, (self.values[-1] - REST) / REST_SPREAD
        return 0.5 * float(noise**2 + rest**2 + np.sum(np.exp(2.0 * self.values[1:-1])) / self.level**2)

    def penalty_slopes(self) -> Array:
        """Slopes of the penalty, (2 + G,)."""
        noise, rest = self.values[0] / self.noise_spread**2, (self.values[-1] - REST) / REST_SPREAD**2
        return np.array([noise, *np.exp(2.0 * self.values[1:-1]) / self.level**2, rest])

    def without_discrepancy(self, noise: float) -> "Scales":
        """The same with no discrepancy and another noise. `noise`: σ."""
        values = self.values.copy()
        values[0], values[1:-1] = max(np.log(noise), self.finest), np.log(LEAST * self.level)
        return replace(self, values=values)
