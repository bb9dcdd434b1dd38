"""Effects that are there for a part of the time only: what they do, and the window in which they do it."""

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from tauscope.effects.context import Signals
from tauscope.effects.effect import Effect
from tauscope.recording.recording import Array

EVERY = -1.0  # scope of a window that lies at the same instants of every recording, held-out ones included
HALF_SINE = 1.0  # profile of a window that rises and falls as half a sine
# …of one that is open wherever the rectangular one is shut, in the training recordings; any other is rectangular.
OUTSIDE = -1.0


def since(recording: int) -> float:
    """Scope of a window that opens in one recording and stays open through all later ones."""
    return -2.0 - recording


class TimeLocalEffect(Effect):
    """An effect seen through a window w(t); its first shapes are scope, start, end and profile of the window.

    The scope is the index of the one recording that the window belongs to, `EVERY`, or `since` a recording.
    """

    no_code = "it belongs to instants of the recordings"

    @abstractmethod
    def torque(self, signals: Signals, shape: Array) -> Array:
        """Torque per unit of each coefficient, (c, m, N), of a shape, (k,), whose window is always open."""

    @staticmethod
    def is_shared(shape: Array) -> bool:
        """Whether held-out recordings have the window of `shape`, (k,), at the same instants."""
        return bool(shape[0] == EVERY)

    def twins(self, shape: Array, recordings: int) -> list[tuple[float, Array]]:
        """Signs and shapes, (k,), of the windows that only held-out recordings tell from that of `shape`, (k,).

        `recordings`: number of training recordings.
        """
        if recordings > 1 or self.is_shared(shape):
            return []
        return [(1.0, np.concatenate([[EVERY], shape[1:]]))]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """The torque within the windows: `shapes`, (g, k), scope, start [s], end [s], profile, the effect's own."""
        found = []
        for shape in shapes:
            window = open_share(shape, signals.recording, signals.time, 1.0 / signals.rate_hz)
            found.append(self.torque(signals, shape)[:, :, None, :] * window)
        return np.stack(found)

    def when(self, coefficients: Array, shape: Array, names: Sequence[str], durations: Sequence[float]) -> str:
        """When, in words, by coefficients, (c,), shape, (k,), and the recordings' durations [s]."""
        scope, start, end = shape[:3]
        if scope < EVERY:
            return f"from {start:.2f} s of {names[int(-2 - scope)]} on"
        return f"from {start:.2f} to {end:.2f} s of {self.recording_words(shape, names)}"

    @staticmethod
    def recording_words(shape: Array, names: Sequence[str]) -> str:
        """Which recording, in words. `shape`: (k,), values of the shape parameters."""
        scope = shape[0]
        if scope == EVERY:
            return "every recording"
        return names[int(-2 - scope) if scope < EVERY else int(scope)]


def open_share(shapes: Array, recording: int, time: Array, interval_s: float) -> Array:
    """w(t) of windows, (N,): 1 where one is open, the part of an interval at the samples that its edges cut.

    `shapes`: (..., k), scope, start [s], end [s], profile: of one window, or of one a sample; `time`: instants, from
    the beginning of the recording [s]; `interval_s`: what one instant stands for [s].
    """
    scope, start, end, profile = np.moveaxis(shapes[..., :4], -1, 0)
    first = np.where(scope < EVERY, -2.0 - scope, np.inf)  # the recording in which it opens for good
    share = np.clip((time - start) / interval_s + 0.5, 0.0, 1.0)
    share = share * np.where(scope < EVERY, 1.0, np.clip((end - time) / interval_s + 0.5, 0.0, 1.0))
    length = np.maximum(end - start, interval_s)
    inside = (time > start) & (time < end)
    sine = np.sin(np.pi * np.where(inside, time - start, 0.0) / length)
    share = np.where((profile == HALF_SINE) & (scope >= EVERY), sine, share)
    share = np.where((scope == EVERY) | (scope == recording) | (first == recording), share, 0.0)
    if recording < 0:
        return np.where(profile == OUTSIDE, 0.0, share)
    share = np.where(first < recording, 1.0, share)
    return np.where(profile == OUTSIDE, 1.0 - share, share)
