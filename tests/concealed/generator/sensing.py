"""What the sensors make of a passage: effects of the sensors, noise, encoder steps; and the recordings that result."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from concealed.generator.forward import Entry, Passage, sensory
from concealed.generator.motions import RATE_HZ, Asked
from tauscope.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Noise:
    """Of the sensors.

    torque_std : tuple of float
        at the recorded rate [Nm]
    position_std : float
        [rad]
    encoder_step : float
        zero for none [rad]
    dropped : float
        share of samples that the logger lost
    kind : str
        ``white``, ``coloured`` (half of its power below 2 Hz) or ``heavy`` (Student's t with three degrees of freedom)
    """

    torque_std: tuple[float, ...]
    position_std: float = 2e-5
    encoder_step: float = 0.0
    dropped: float = 0.0
    kind: str = "white"


def sensed(entries: Sequence[Entry], position: Array, torque: Array) -> tuple[Array, Array]:
    """Position and torque (N, n) at the recorded rate, as sensors without noise report them."""
    channels = [effect.channel(position.shape[1]) for effect in sensory(entries)]
    for channel in channels:
        rows = [channel.pass_on(k / RATE_HZ, q, u) for k, (q, u) in enumerate(zip(position, torque, strict=True))]
        position, torque = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    return position, torque


def recording(
    motion: Asked,
    passage: Passage,
    entries: Sequence[Entry],
    noise: Noise,
    rng: np.random.Generator,
    *,
    every: int = 1,
    states_periods: bool = True,
) -> Recording:
    """What a logger leaves; `every` nth sample."""
    position, torque = sensed(entries, *passage.recorded)
    position = position + noise.position_std * rng.standard_normal(position.shape)
    if noise.encoder_step:
        position = np.rint(position / noise.encoder_step) * noise.encoder_step
    torque = torque + np.array(noise.torque_std) * _unit_noise(noise.kind, torque.shape, rng)
    time = np.arange(len(position)) / RATE_HZ
    kept = np.flatnonzero(np.arange(len(time)) % every == 0)
    if noise.dropped:
        kept = kept[rng.random(len(kept)) >= noise.dropped]
    period = motion.period[kept] if states_periods and np.isfinite(motion.period).any() else None
    return Recording.from_arrays(motion.name, time[kept], position[kept], torque[kept], period=period)


def _unit_noise(kind: str, shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    white = rng.standard_normal(shape)
    if kind == "heavy":
        return rng.standard_t(3.0, shape) / np.sqrt(3.0)
    if kind == "coloured":
        slow = signal.sosfilt(signal.butter(1, 2.0, fs=RATE_HZ, output="sos"), rng.standard_normal(shape), axis=0)
        return np.sqrt(0.5) * (white + slow / slow.std(axis=0))
    return white
