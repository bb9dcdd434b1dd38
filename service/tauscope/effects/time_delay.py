"""A torque channel that is late against the positions: by a delay, or behind a low-pass filter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Quantities, Quantity, Shape, Sizes, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Share of the torque that a constant near the right one makes late: the right one makes all of it late at most.
LARGEST_SHARE = 2.0
# A channel is late as a whole: where less than half of its torque seems to be, noise or something else does.
SMALLEST_SHARE = 0.5
# Time constants looked at, relative to that of the band: one that is much shorter is a delay.
LAGS = np.array([0.25, 0.5, 1.0, 2.0, 4.0])
ORDERS = (1, 2)


class LateTorque(Effect):
    """A torque channel that is late against the positions."""

    id = "time_delay"
    rank = 170
    equation = "tau_recorded(t) = tau(t - d)"
    meaning = "the torque channel is late against the positions (early where d is negative)"
    remedy = "shift the torque channel by d"
    no_code = "it changes the recorded torque, not the arm's"
    revealing_motion = "fast motion with quick changes of torque"

    @staticmethod
    def places(context: ArmContext) -> Sequence[int | None]:
        """The whole arm, and every joint of an arm with several."""
        return (None, *(context.joints if context.robot.joint_count > 1 else ()))

    def claim(self, found: Sizes, context: ArmContext) -> str:
        verb = "lags" if found["d"].value >= 0.0 else "leads"
        return f"torque {verb} position by {size_text(found['d'])}"

    def advice(self, found: Sizes) -> str:
        way = "earlier" if found["d"].value >= 0.0 else "later"
        return f"shift the torque channel {size_text(found['d'])} {way}"

    def place(self, joint_names: Sequence[str]) -> str:
        return super().place(joint_names) or "at every joint"

    def measured(self, signals: Signals) -> Array:
        """Torque of the model at the joints that are late, (m, N)."""
        return signals.torque[list(self.touched(len(signals.torque)))]


class TimeDelay(LateTorque):
    """τ_recorded(t) = τ(t - d), to first order -d dτ/dt."""

    coefficients = (Coefficient("d", "s"),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """All forms, the small delay first."""
        return [*(cls(place) for place in cls.places(context)), *Shift.forms(context), *Lag.forms(context)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """-dτ/dt of the model's torque."""
        torque = self.measured(signals)
        # Over two samples: where friction steps from one sample to the next, a finer slope is no torque that anybody
        # records.
        return -np.gradient(torque, 1.0 / signals.rate_hz, axis=-1)[None, None]

    def torque_of(self, signals: Signals, coefficients: Array, shape: Array) -> Array:
        """τ(t - d) - τ(t): friction's step arrives late, it does not become a spike."""
        torque = self.measured(signals)
        return shifted(torque, float(coefficients[0]), signals) - torque

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"delay": coefficients[0]}]


class Shift(LateTorque):
    """τ_recorded = τ + a (τ_T - τ), τ_T(t) = τ(t - T): a delay that is no small matter for the band.

    All of the torque is late with a = 1; reported is d = a T, by which slow changes are late.
    """

    is_variant = True
    coefficients = (Coefficient("a", "1", positive=True, largest=LARGEST_SHARE, smallest=SMALLEST_SHARE, whole=1.0),)
    shapes = (Shape("T", "s", logarithmic=True),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        return [cls(place, *_constants(context)) for place in cls.places(context)]

    def late(self, torque: Array, constant: float, signals: Signals) -> Array:
        """Torque (m, N) as it is recorded with a = 1. `torque`: (m, N), as it is [Nm or N]; `constant`: T [s]."""
        return shifted(torque, constant, signals)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """What is recorded less what is there."""
        torque = self.measured(signals)
        recorded = np.stack([self.late(torque, float(constant), signals) for constant in shapes[:, 0]])
        return (recorded - torque)[:, None]

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        """The mean delay d = a T: it is known well also where a and T are not."""
        share, constant = float(coefficients[0]), float(shape[0])
        slope = np.array([constant, share])
        return (Quantity("d", share * constant, float(np.sqrt(max(slope @ covariance @ slope, 0.0))), "s"),)

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"delay": coefficients[0] * shape[0]}]


@dataclass(frozen=True, eq=False)
class Lag(Shift):
    """The same with τ_T behind a low-pass filter with n equal time constants T, as sensors and drives have it.

    Reported are d = a n T, T and n.
    """

    equation = "tau_recorded = tau + d/(n T) (tau_T - tau), (1 + T d/dt)^n tau_T = tau"
    meaning = "the torque channel is low-pass filtered, and so late against the positions"
    remedy = "filter the positions alike, or undo the filter of time constant T"

    order: int = 1

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        places = cls.places(context)
        return [cls(place, *_constants(context), order=order) for place in places for order in ORDERS]

    def claim(self, found: Sizes, context: ArmContext) -> str:
        return f"a low-pass filter delays torque by {size_text(found['d'])}"

    def advice(self, found: Sizes) -> str:
        """A filter has no shift that undoes it."""
        return self.remedy

    def late(self, torque: Array, constant: float, signals: Signals) -> Array:
        """Torque (m, N) behind the filter."""
        return low_passed(torque, constant, self.order, signals)

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        (each,) = super().quantities(context, coefficients, shape, covariance)
        own = float(np.sqrt(max(covariance[1, 1], 0.0)))
        return (
            Quantity("d", self.order * each.value, self.order * each.std, "s"),
            Quantity("T", float(shape[0]), own, "s"),
            Quantity("n", self.order, 0.0, "1"),
        )

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """The mean delay a n T: to first order a filter is a delay."""
        return [{"delay": coefficients[0] * shape[0] * self.order}]


def _constants(context: ArmContext) -> tuple[Array, Array, Array]:
    """Grid (g, 1), lower and upper bound (1,) of T [s]."""
    constants = LAGS / (2.0 * np.pi * context.cutoff_hz)
    return constants[:, None], 0.3 * constants[:1], 2.0 * constants[-1:]


def shifted(torque: Array, delay: float, signals: Signals) -> Array:
    """Torque that is late, linear from sample to sample, (m, N). `torque`: (m, N), as it is [Nm or N]; `delay`: [s]."""
    instants = np.arange(torque.shape[1]) / signals.rate_hz
    period = torque.shape[1] / signals.rate_hz if signals.periodic else None
    return np.stack([np.interp(instants - delay, instants, row, period=period) for row in torque])


def low_passed(torque: Array, constant: float, order: int, signals: Signals) -> Array:
    """Torque, (m, N) before and behind a filter, exact for torque that is linear from sample to sample."""
    samples = constant * signals.rate_hz
    kept = float(np.exp(-1.0 / samples))
    now, before = 1.0 - (1.0 - kept) * samples, (1.0 - kept) * samples - kept
    filtered = torque
    for _ in range(order):
        last, start = filtered[:, :1], filtered[:, :1]
        if signals.periodic:
            # A period later the filter stands as it stood: y₀ kept^N + the response to one period is y₀ again.
            last = filtered[:, -1:]
            once, _ = signal.lfilter([now, before], [1.0, -kept], filtered, zi=before * last)
            start = once[:, -1:] / (1.0 - kept ** torque.shape[1])
        filtered, _ = signal.lfilter([now, before], [1.0, -kept], filtered, zi=before * last + kept * start)
    return filtered
