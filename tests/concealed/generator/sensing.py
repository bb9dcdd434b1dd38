"""What the sensors make of a passage: effects of the sensors, noise, encoder steps; and the recordings that result."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from concealed.generator.forward import Entry, Passage, sensory
from concealed.generator.motions import Asked
from concealed.generator.rates import RATE_HZ
from tauscope.recording import Recording

Array = NDArray[np.float64]


CORRELATION = 0.95
"""Of autoregressive noise, from one recorded sample to the next."""

BUNCH = 4
"""Samples that arrive together where stamps are bunched."""

BUNCHED_S = 1e-4
"""Between their stamps [s]."""

DROPOUT_S = 0.4
"""How long a drive reports a torque of zero [s]."""


@dataclass(frozen=True)
class Noise:
    """Of the sensors.

    torque_std : tuple of float
        at the recorded rate [Nm]
    position_std : float
        [rad]
    encoder_step : float
        zero for none [rad]
    torque_step : float
        one count of the reported current, in standard deviations of its noise; zero for none
    dropped : float
        share of samples that the logger lost
    dropouts : int
        stretches of `DROPOUT_S` without torque
    held : int
        the controller renews its values every so many recorded samples
    bunched : float
        share of samples that were kept waiting and stamped with the next
    kind : str
        ``white``, ``coloured`` (half of its power below 2 Hz), ``heavy`` (Student's t with three degrees of freedom) or
        ``autoregressive`` (of first order, `CORRELATION`)
    """

    torque_std: tuple[float, ...]
    position_std: float = 2e-5
    encoder_step: float = 0.0
    torque_step: float = 0.0
    dropped: float = 0.0
    dropouts: int = 0
    held: int = 1
    bunched: float = 0.0
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
    std = np.array(noise.torque_std)
    torque = torque + std * _unit_noise(noise.kind, torque.shape, rng, every)
    if noise.torque_step:
        torque = np.rint(torque / (noise.torque_step * std)) * (noise.torque_step * std)
    time = np.arange(len(position)) / RATE_HZ
    kept = np.flatnonzero(np.arange(len(time)) % every == 0)
    if noise.dropped:
        kept = kept[rng.random(len(kept)) >= noise.dropped]
    time, position, torque, period = time[kept], position[kept], torque[kept], motion.period[kept]
    if noise.held > 1:
        renewed = np.arange(len(time)) // noise.held * noise.held
        position, torque = position[renewed], torque[renewed]
    for first in rng.uniform(0.1, 0.9, noise.dropouts) * time[-1]:
        torque[(time >= first) & (time < first + DROPOUT_S)] = 0.0
    stamps = _bunch(time, noise.bunched, rng) if noise.bunched else time
    told = period if states_periods and np.isfinite(motion.period).any() else None
    return Recording.from_arrays(motion.name, stamps, position, torque, period=told)


def _bunch(time: Array, share: float, rng: np.random.Generator) -> Array:
    """Stamps of which a share is of samples that were kept waiting, and came together with the one after them."""
    stamps, waiting = time.copy(), BUNCH - 1
    for last in np.flatnonzero(rng.random(len(time)) < share / waiting):
        if last >= waiting:
            stamps[last - waiting : last] = time[last] - BUNCHED_S * np.arange(waiting, 0, -1)
    return stamps


def _unit_noise(kind: str, shape: tuple[int, ...], rng: np.random.Generator, every: int) -> Array:
    white = rng.standard_normal(shape)
    if kind == "heavy":
        return rng.standard_t(3.0, shape) / np.sqrt(3.0)
    if kind == "coloured":
        slow = signal.sosfilt(signal.butter(1, 2.0, fs=RATE_HZ, output="sos"), rng.standard_normal(shape), axis=0)
        return np.sqrt(0.5) * (white + slow / slow.std(axis=0))
    if kind == "autoregressive":
        correlation = CORRELATION ** (1.0 / every)
        begin = correlation * rng.standard_normal((1, *shape[1:]))
        return np.asarray(
            signal.lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], white, axis=0, zi=begin)[0]
        )
    return white
