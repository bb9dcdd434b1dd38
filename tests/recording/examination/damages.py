"""Damages of a sound recording, as loggers, buses and drives make them, and the warning that each must have."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tauscope.recording import Recording

Array = NDArray[np.float64]


@dataclass(eq=False)
class Channels:
    """The columns of a recording, to be damaged in place; stamps may repeat and run backwards."""

    time: Array
    position: Array
    effort: Array
    optional: dict[str, Array | None] = field(default_factory=dict)

    @staticmethod
    def of(recording: Recording) -> "Channels":
        samples = recording.samples()
        optional = {"velocity": samples.velocity, "period": samples.period}
        return Channels(
            samples.time.copy(),
            samples.position.copy(),
            samples.effort.copy(),
            {name: None if values is None else values.copy() for name, values in optional.items()},
        )

    def keep(self, rows: NDArray[np.intp]) -> None:
        self.time, self.position, self.effort = self.time[rows], self.position[rows], self.effort[rows]
        self.optional = {name: None if values is None else values[rows] for name, values in self.optional.items()}

    def csv(self) -> str:
        n = self.position.shape[1]
        names = ["t", *(f"q{k}" for k in range(1, n + 1)), *(f"tau{k}" for k in range(1, n + 1))]
        columns = [self.time[:, None], self.position, self.effort]
        if (velocity := self.optional.get("velocity")) is not None:
            names += [f"qd{k}" for k in range(1, n + 1)]
            columns.append(velocity)
        if (period := self.optional.get("period")) is not None:
            names.append("period")
            columns.append(period[:, None])
        rows = np.hstack(columns).tolist()
        return "\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def repeat_stamps(channels: Channels, rng: np.random.Generator) -> None:
    rows = rng.choice(np.arange(5, len(channels.time)), 6, replace=False)
    channels.keep(np.sort(np.concatenate([np.arange(len(channels.time)), rows])))


def swap_rows(channels: Channels, rng: np.random.Generator) -> None:
    order = np.arange(len(channels.time))
    for row in rng.choice(np.arange(10, len(order) - 10, 10), 5, replace=False):
        order[[row, row + 1]] = order[[row + 1, row]]
    channels.keep(order)


def bunch_stamps(channels: Channels, rng: np.random.Generator) -> None:
    for row in rng.choice(np.arange(10, len(channels.time) - 10, 10), 3, replace=False):
        channels.time[row] = channels.time[row + 1] - 1e-7


def queue_samples(channels: Channels, rng: np.random.Generator) -> None:
    stamps = channels.time
    for last in np.flatnonzero(rng.random(len(stamps)) < 0.015):
        first = max(last - 3, 0)
        stamps[first:last] = stamps[last] - 1e-5 * np.arange(last - first, 0, -1)


def drop_efforts(channels: Channels, rng: np.random.Generator) -> None:
    channels.effort[rng.choice(len(channels.time), 40, replace=False)] = 0.0


def drop_long(channels: Channels, rng: np.random.Generator) -> None:
    start = int(rng.integers(200, len(channels.time) - 300))
    channels.effort[start : start + int(rng.integers(20, 150))] = 0.0


def spike_efforts(channels: Channels, rng: np.random.Generator) -> None:
    span = np.ptp(channels.effort, axis=0)
    for joint in range(channels.effort.shape[1]):
        rows = rng.choice(len(channels.time), 15, replace=False)
        channels.effort[rows, joint] += rng.choice([-1, 1], 15) * span[joint] * rng.uniform(1.0, 50.0, 15)


def spike_positions(channels: Channels, rng: np.random.Generator) -> None:
    joint = int(rng.integers(channels.position.shape[1]))
    rows = rng.choice(np.arange(10, len(channels.time) - 10, 10), 10, replace=False)
    channels.position[rows, joint] += rng.choice([-1, 1], 10) * rng.uniform(0.5, 100.0, 10)


def reset_encoder(channels: Channels, rng: np.random.Generator) -> None:
    joint, row = int(rng.integers(channels.position.shape[1])), int(len(channels.time) * rng.uniform(0.6, 0.9))
    channels.position[row:, joint] += rng.choice([-1, 1]) * rng.uniform(0.5, 3.0)


def wrap_angles(channels: Channels, rng: np.random.Generator) -> None:
    joint = int(np.argmax(np.ptp(channels.position, axis=0)))
    middle = np.median(channels.position[:, joint])
    channels.position[:, joint] -= 2 * np.pi * np.floor((channels.position[:, joint] - middle) / (2 * np.pi))


def freeze_positions(channels: Channels, rng: np.random.Generator) -> None:
    speed = np.abs(np.gradient(channels.position, axis=0))
    joint = int(rng.integers(channels.position.shape[1]))
    fast = np.flatnonzero(speed[:, joint] > 0.5 * speed[:, joint].max())
    fast = np.unique(fast[(fast > 40) & (fast < len(speed) - 40)] // 40)
    length = int(rng.integers(2, 7))
    for row in 40 * rng.choice(fast, min(3, len(fast)), replace=False):
        channels.position[row : row + length, joint] = channels.position[row, joint]


def stick_efforts(channels: Channels, rng: np.random.Generator) -> None:
    for start in rng.choice(np.arange(100, len(channels.time) - 100, 100), 3, replace=False):
        channels.effort[start : start + 40] = channels.effort[start]


def hold_efforts(channels: Channels, rng: np.random.Generator) -> None:
    channels.effort = channels.effort[np.arange(len(channels.time)) // 4 * 4]


def hold_all(channels: Channels, rng: np.random.Generator) -> None:
    rows = np.arange(len(channels.time)) // 3 * 3
    channels.effort, channels.position = channels.effort[rows], channels.position[rows]


DAMAGES: dict[Callable[[Channels, np.random.Generator], None], str] = {
    repeat_stamps: "time-stamps",
    swap_rows: "time-stamps",
    bunch_stamps: "time-stamps",
    queue_samples: "time-stamps",
    drop_efforts: "effort-dropouts",
    drop_long: "effort-dropouts",
    spike_efforts: "spikes",
    spike_positions: "spikes",
    reset_encoder: "encoder-reset",
    wrap_angles: "wrapped-angle",
    freeze_positions: "stuck-samples",
    stick_efforts: "stuck-samples",
    hold_efforts: "held-samples",
    hold_all: "held-samples",
}
"""Each damage with the code of its warning."""
