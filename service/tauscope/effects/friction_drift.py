"""Friction that changes over time: with a temperature that was recorded, by the clock, or by friction's own heat."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Quantities, Quantity, Shape, Sizes, size_text
from tauscope.recording.recording import Array

TIMES = np.array([0.08, 0.2, 0.5, 1.2, 3.0])  # time constants looked at, relative to the longest recording
# Range of a recorded temperature from which friction may follow it [K]: motors report whole degrees.
LEAST_WARMING = 2.0
RATES = np.array([0.0, 0.03])  # relative changes of viscosity looked at [1/K]: greases and oils lose 2 to 5 % a kelvin
FASTEST = 0.06  # …and the largest [1/K]
NO_RATE = 1e-9  # rate below which friction is a straight line in temperature [1/K]


@dataclass(frozen=True, eq=False)
class FrictionDrift(Effect):
    """τ = (f A(q̇) + w q̇) h(t), T ḣ = p / (1 - e^{-D/T}) - h, h = 0 when recording begins.

    f and w are what friction changes by until D under p = 1, however slowly it does: a T far beyond the recordings
    would else leave them open. By the clock p is 1. By heat it is the power that the model's friction dissipates, in
    watts: a joint that rests or creeps cools.
    """

    has_step = True
    id = "friction_drift"
    rank = 80
    arguments = frozenset({"velocity", "time"})
    equation = "tau = (f sgn(qd) + w qd) h, T dh/dt = p / (1 - exp(-D/T)) - h, p = 1 or friction's own power / 1 W"
    meaning = "friction changes over time, as in a warm-up"
    remedy = "warm the joint up before recording, or let friction depend on temperature"
    no_code = "it needs the clock or the temperature of the joint"
    no_scenario = "the simulated drift needs a thermal resistance, which was not measured"
    revealing_motion = "the first motion once more at the end"
    coefficients = (Coefficient("f", "{tau}"), Coefficient("w", "{tau} s/{q}"))
    shapes = (Shape("T", "s", logarithmic=True),)

    duration_s: float = 1.0  # D, of the longest recording [s]
    by_heat: bool = False

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """With temperature and by the clock where that was recorded, else by the clock and by heat."""
        longest = max(context.durations)
        times = TIMES * longest
        grid = times[:, None], 0.5 * times[:1], 1.5 * times[-1:]
        found: list[Effect] = []
        for joint in (joint for joint in context.joints if context.moves(joint)):
            if context.warming(joint) >= LEAST_WARMING:
                found += [ThermalDrift.of(context, joint), cls(joint, *grid, longest)]
            else:
                found += [cls(joint, *grid, longest, by_heat) for by_heat in (False, True)]
        return found

    def claim(self, found: Sizes, context: ArmContext) -> str:
        change = found["f"].value + found["w"].value * float(context.speed[self.joint or 0])
        verb, size = "rises" if change >= 0.0 else "falls", size_text(replace(found["f"], value=change))
        return f"friction {verb} by {size} {'per watt of its own heat' if self.by_heat else 'during a recording'}"

    def columns(self, signals: Signals, shapes: Array) -> Array:
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


@dataclass(frozen=True, eq=False)
class ThermalDrift(FrictionDrift):
    """τ = (f A(q̇) + w q̇) h(ϑ), h = (1 - e^{-r (ϑ - ϑ_0)}) / r, ϑ the temperature that was recorded.

    f and w are what friction changes by a kelvin at ϑ_0. Where no temperature is known h is zero.
    """

    is_variant = True
    arguments = frozenset({"velocity", "temperature"})
    equation = "tau = (f sgn(qd) + w qd) (1 - exp(-r (T - T_0))) / r, T the recorded temperature"
    meaning = "friction changes with the joint's temperature"
    remedy = "let friction depend on temperature, or warm the joint up before recording"
    revealing_motion = "the same motion cold and warm"
    coefficients = (Coefficient("f", "{tau}/K"), Coefficient("w", "{tau} s/{q}/K"))
    shapes = (Shape("r", "1/K"),)

    reference_c: float = 0.0  # ϑ_0, middle of the temperatures of training [°C]

    @classmethod
    def of(cls, context: ArmContext, joint: int) -> "ThermalDrift":
        """The form of a joint whose temperature was recorded. `joint`: index, from 0."""
        bounds = np.zeros(1), np.array([FASTEST])
        reference = 0.5 * float(context.coldest[joint] + context.hottest[joint])
        return cls(joint, RATES[:, None], *bounds, max(context.durations), reference_c=reference)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        joint = self.joint or 0
        warmer = np.zeros(signals.time.shape)
        if signals.temperature is not None:
            warmer = np.nan_to_num(signals.temperature[joint] - self.reference_c)
        rate = np.where(np.abs(shapes[:, 0]) < NO_RATE, NO_RATE, shapes[:, 0])[:, None, None]
        course = -np.expm1(-rate * warmer) / rate
        own = np.stack([signals.step[joint], signals.velocity[joint]])
        return (own[None, :, None, :] * course[:, None])[:, :, None]

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        return (
            *super().quantities(context, coefficients, shape, covariance),
            Quantity("T_0", self.reference_c, 0.0, "°C"),
        )
