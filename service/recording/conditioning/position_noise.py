"""How noisy the positions are, and how wide a band they can stand.

Noise of density S_n in q becomes ω⁴ S_n in q̈. It biases every inertial parameter towards zero by the share that it has
in the energy of q̈ (errors in variables), so the band must end where that share grows too large.
"""

from dataclasses import dataclass

import numpy as np
from scipy import signal

from service.recording.conditioning.uniform import Stretch
from service.recording.recording import Array

NOISE_SHARE = 0.04
"""Largest rms of noise in q̈, relative to the motion's own q̈, inside the band: a bias of its square, 0.16 %."""

PLATEAU = (0.6, 0.9)
"""Part of the spectrum, relative to Nyquist, that no arm moves in: what is there is noise."""

STANDING_STILL = 10.0
"""A joint whose range is below this many noise standard deviations does not move, and sets no band."""


@dataclass(frozen=True, eq=False)
class PositionNoise:
    """Noise of the measured positions.

    density : (n,) float64
        one-sided spectral density S_n [rad²/Hz]
    limit_hz : float or None
        widest band in which q̈ keeps to `NOISE_SHARE`; None where the whole spectrum does
    """

    density: Array
    limit_hz: float | None


def position_noise(stretch: Stretch) -> PositionNoise:
    """Noise density of every joint's position from the plateau of its spectrum, and the band that it allows.

    Parameters
    ----------
    stretch : Stretch
        a stretch of motion, the longer the better

    Returns
    -------
    PositionNoise
        density and limit; the quantisation step's own density, step²/(6 fs), is the least that is assumed
    """
    rate = stretch.rate_hz
    nyquist = rate / 2.0
    # The second difference is nearly white where q itself is not: the spectrum's leakage then stays below the noise.
    acceleration = np.diff(stretch.position, n=2, axis=0) * rate**2
    frequency, spectrum = signal.welch(acceleration, rate, nperseg=min(1024, len(acceleration)), axis=0)
    shape = (2.0 * rate * np.sin(np.pi * frequency / rate)) ** 4
    plateau = (frequency >= PLATEAU[0] * nyquist) & (frequency <= PLATEAU[1] * nyquist)
    density = np.median(spectrum[plateau] / shape[plateau, None], axis=0)
    density = np.maximum(density, _quantisation_density(stretch))
    noise = density * np.cumsum(shape)[:, None]
    motion = np.maximum(np.cumsum(spectrum, axis=0) - noise, 0.0)
    moving = np.ptp(stretch.position, axis=0) > STANDING_STILL * np.sqrt(density * nyquist)
    bearable = (noise <= NOISE_SHARE**2 * np.maximum.accumulate(motion, axis=0))[:, moving].all(axis=1)
    usable = frequency <= PLATEAU[1] * nyquist
    if not moving.any() or bearable[usable].all():
        return PositionNoise(density, None)
    last = np.flatnonzero(bearable & usable)
    return PositionNoise(density, float(frequency[max(last[-1], 1)]) if len(last) else float(frequency[1]))


def _quantisation_density(stretch: Stretch) -> Array:
    """Density of the rounding error of an encoder's step; the smallest difference between values is the step."""
    steps = []
    for column in stretch.position.T:
        differences = np.diff(np.unique(column))
        steps.append(differences.min() if len(differences) and not stretch.resampled else 0.0)
    return np.square(steps) / (6.0 * stretch.rate_hz)
