"""Friction that changes over time: grease that warms up, by the clock or by the heat that friction itself makes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Shape, Sizes, size_text
from tauscope.recording.recording import Array

TIMES = np.array([0.08, 0.2, 0.5, 1.2, 3.0])
"""Time constants looked at, relative to the longest recording."""


@dataclass(frozen=True, eq=False)
class FrictionDrift(Effect):
    """τ = (f A(q̇) + w q̇) h(t), T ḣ = p / (1 - e^{-D/T}) - h, h = 0 when recording begins.

    f and w are what friction changes by until D under p = 1, however slowly it does: a T far beyond the recordings
    would else leave them open. By the clock p is 1. By heat it is the power that the model's friction dissipates, in
    watts: a joint that rests or creeps cools.

    duration_s : float
        D, of the longest recording [s]
    """

    repeats_with_motion = False
    has_step = True
    id = "friction_drift"
    rank = 80
    german = "Drift der Reibung"
    arguments = frozenset({"velocity", "time"})
    equation = "tau = (f sgn(qd) + w qd) h, T dh/dt = p / (1 - exp(-D/T)) - h, p = 1 or friction's own power / 1 W"
    meaning = "friction changes over time, as in a warm-up"
    remedy = "warm the joint up before recording, or let friction depend on temperature"
    no_code = "it needs the clock or the temperature of the joint"
    no_scenario = "the simulated drift needs a thermal resistance, which was not measured"
    revealing_motion = "the first motion once more at the end"
    coefficients = (Coefficient("f", "{tau}"), Coefficient("w", "{tau} s/{q}"))
    shapes = (Shape("T", "s", logarithmic=True),)

    duration_s: float = 1.0
    by_heat: bool = False

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """Both ways, a joint that moves."""
        longest = max(context.durations)
        times = TIMES * longest
        grid = times[:, None], 0.5 * times[:1], 1.5 * times[-1:]
        moving = [joint for joint in context.joints if context.moves(joint)]
        return [cls(joint, *grid, longest, by_heat) for joint in moving for by_heat in (False, True)]

    def claim(self, found: Sizes, context: ArmContext) -> str:
        """Whether friction rises or falls, at the joint's usual speed."""
        change = found["f"].value + found["w"].value * float(context.speed[self.joint or 0])
        verb, size = "rises" if change >= 0.0 else "falls", size_text(replace(found["f"], value=change))
        return f"friction {verb} by {size} {'per watt of its own heat' if self.by_heat else 'during a recording'}"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """A(q̇) h, q̇ h, repetition by repetition."""
        constants = shapes[:, 0]
        if self.by_heat:
            course = self._temperature(signals, constants)
        else:
            course = 1.0 - np.exp(-signals.time[None] / constants[:, None, None])
        course = course / (1.0 - np.exp(-self.duration_s / constants))[:, None, None]
        own = np.stack([signals.step[self.joint], signals.velocity[self.joint]])
        return (own[None, :, None, :] * course[:, None])[:, :, None]

    def _temperature(self, signals: Signals, constants: Array) -> Array:
        """T ϑ̇ = p - ϑ of a joint that its friction warms, (g, P, N); before the piece it did so as within it."""
        friction = signals.torque[self.joint] - signals.load[self.joint]
        power = np.maximum(friction * signals.velocity[self.joint], 0.0)
        power = np.tile(power, signals.time.shape[0])
        before = max(float(signals.time[0, 0]), 0.0)
        found = []
        for constant in constants:
            kept = np.exp(-1.0 / (signals.rate_hz * constant))
            start = kept * power.mean() * (1.0 - np.exp(-before / constant))
            found.append(signal.lfilter([1.0 - kept], [1.0, -kept], power, zi=[start])[0].reshape(signals.time.shape))
        return np.stack(found)
