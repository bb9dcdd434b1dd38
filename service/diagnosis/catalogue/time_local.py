"""Effects that are there for a part of the time only: what they do, and the window in which they do it.

A window is found by its edges among a great many. Their columns are one and the same torque, seen through different
windows: a screening needs that torque once (`service.diagnosis.screening.windows`), and the exact columns where it
refines.
"""

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Effect
from service.diagnosis.catalogue.signals import Signals
from service.recording.recording import Array

EVERY = -1.0
"""Scope of a window that lies at the same instants of every recording, held-out ones included."""

HALF_SINE = 1.0
"""Profile of a window that rises and falls as half a sine."""

OUTSIDE = -1.0
"""…of one that is open wherever the rectangular one is shut, in the training recordings; any other is rectangular."""


ROUGHLY = 40
"""Windows that stand for all in a rough grid."""


def since(recording: int) -> float:
    """Scope of a window that opens in one recording and stays open through all later ones.

    Parameters
    ----------
    recording : int
        index of the recording, from 0
    """
    return -2.0 - recording


class TimeLocalEffect(Effect):
    """An effect seen through a window w(t); its first shapes are scope, start, end and profile of the window.

    The scope is the index of the one recording that the window belongs to, `EVERY`, or `since` a recording.
    """

    repeats_with_motion: ClassVar[bool] = False

    @abstractmethod
    def torque(self, signals: Signals, shape: Array) -> Array:
        """Torque per unit of each coefficient as if the window were always open, (c, m, N).

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shape : (k,) float64
            values of the shape parameters; those of the window do not matter
        """

    def outside(self, shape: Array) -> Array | None:
        """Shape of the same effect wherever else in the training recordings, where that may be meant; else None.

        Parameters
        ----------
        shape : (k,) float64
            values of the shape parameters
        """
        return None

    def rough_grid(self) -> Array:
        """Few of the many windows, (g, k)."""
        return self.grid[:: max(1, len(self.grid) // ROUGHLY)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """The torque within the windows.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, k) float64
            scope, start [s], end [s], profile, then the effect's own
        """
        found = []
        for shape in shapes:
            window = open_share(shape, signals.recording, signals.time, 1.0 / signals.rate_hz)
            found.append(self.torque(signals, shape)[:, :, None, :] * window)
        return np.stack(found)

    def when(self, coefficients: Array, shape: Array, names: Sequence[str], durations: Sequence[float]) -> str:
        """When, in words.

        Parameters
        ----------
        coefficients : (c,) float64
            estimates
        shape : (k,) float64
            values of the shape parameters
        names : sequence of str
            of the training recordings
        durations : sequence of float
            of the same [s]
        """
        scope, start, end = shape[:3]
        if scope < EVERY:
            return f"from {start:.2f} s of {names[int(-2 - scope)]} on"
        return f"from {start:.2f} to {end:.2f} s of {self.recording_words(shape, names)}"

    @staticmethod
    def recording_words(shape: Array, names: Sequence[str]) -> str:
        """Which recording, in words.

        Parameters
        ----------
        shape : (k,) float64
            values of the shape parameters
        names : sequence of str
            of the training recordings
        """
        scope = shape[0]
        if scope == EVERY:
            return "every recording"
        return names[int(-2 - scope) if scope < EVERY else int(scope)]


def open_share(shape: Array, recording: int, time: Array, interval_s: float) -> Array:
    """w(t) of one window: 1 where it is open, the part of an interval at the samples that its edges cut.

    Parameters
    ----------
    shape : (k,) float64
        scope, start [s], end [s], profile
    recording : int
        index of the recording, negative for held-out ones
    time : (...) float64
        instants, from the beginning of the recording [s]
    interval_s : float
        what one instant stands for [s]
    """
    scope, start, end, profile = shape[:4]
    if profile == OUTSIDE:
        inside = open_share(np.array([scope, start, end, 0.0]), recording, time, interval_s)
        return 1.0 - inside if recording >= 0 else np.zeros_like(time)
    opened = recording >= 0 and scope < EVERY and recording > -2.0 - scope
    if opened:
        return np.ones_like(time)
    if not (scope in (EVERY, float(recording)) or (scope < EVERY and recording == -2.0 - scope)):
        return np.zeros_like(time)
    after = (time - start) / interval_s + 0.5
    if scope < EVERY:
        return np.clip(after, 0.0, 1.0)
    if profile == HALF_SINE:
        length = max(end - start, interval_s)
        return np.where((time > start) & (time < end), np.sin(np.pi * (time - start) / length), 0.0)
    return np.clip(after, 0.0, 1.0) * np.clip((end - time) / interval_s + 0.5, 0.0, 1.0)
