"""A torque channel that is late against the positions: by a delay, or behind a low-pass filter."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from scipy import signal

from service.diagnosis.catalogue.effect import Coefficient, Effect, Shape
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.recording.recording import Array

LAGS = np.array([0.25, 0.5, 1.0, 2.0, 4.0])
"""Time constants looked at, relative to that of the band: one that is much shorter is a delay."""


class TimeDelay(Effect):
    """τ_recorded(t) = τ(t - d), to first order -d dτ/dt."""

    id: ClassVar[str] = "time_delay"
    equation: ClassVar[str] = "tau_recorded(t) = tau(t - d)"
    meaning: ClassVar[str] = "the torque channel is late against the positions (early where d is negative)"
    remedy: ClassVar[str] = "shift the torque channel by d"
    revealing_motion: ClassVar[str] = "fast motion with quick changes of torque"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("d", "s"),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """The whole arm, and every joint of an arm with several.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        places = (None, *(setting.joints if setting.robot.joint_count > 1 else ()))
        constants = LAGS / (2.0 * np.pi * setting.cutoff_hz)
        lags = [Lag(place, constants[:, None], 0.3 * constants[:1], 2.0 * constants[-1:]) for place in places]
        return [*(cls(place) for place in places), *lags]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """-dτ/dt of the model's torque.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (1, 0) float64
            none
        """
        torque = signals.torque[list(self.touched(len(signals.torque)))]
        # Over two samples: where friction steps from one sample to the next, a finer slope is no torque that anybody
        # records.
        return -np.gradient(torque, 1.0 / signals.rate_hz, axis=-1)[None, None]

    def torque_of(self, signals: Signals, coefficients: Array, shape: Array) -> Array:
        """τ(t - d) - τ(t): friction's step arrives late, it does not become a spike.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        coefficients : (1,) float64
            d [s]
        shape : (0,) float64
            none
        """
        torque = signals.torque[list(self.touched(len(signals.torque)))]
        instants = np.arange(torque.shape[1]) / signals.rate_hz
        late = [np.interp(instants - float(coefficients[0]), instants, row) for row in torque]
        return np.stack(late) - torque


class Lag(TimeDelay):
    """T dτ_recorded/dt + τ_recorded = τ: a filter of first order, as sensors and drives have it.

    Column of d: (τ_T - τ)/T, with τ_T the filtered torque; a filter that is all of that has d = T.
    """

    equation: ClassVar[str] = "tau_recorded = tau + d/T (tau_T - tau), T dtau_T/dt + tau_T = tau"
    meaning: ClassVar[str] = "the torque channel is low-pass filtered, and so late against the positions"
    remedy: ClassVar[str] = "filter the positions alike, or undo the filter of time constant T"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("d", "s", positive=True),)
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("T", "s", logarithmic=True),)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """What the filter takes off the model's torque, by its time constant.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 1) float64
            T [s]
        """
        torque = signals.torque[list(self.touched(len(signals.torque)))]
        filtered = np.stack([low_passed(torque, float(constant), signals) for constant in shapes[:, 0]])
        return ((filtered - torque) / shapes[:, :, None])[:, None]

    def torque_of(self, signals: Signals, coefficients: Array, shape: Array) -> Array:
        """Its column: for a given time constant it is linear.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        coefficients : (1,) float64
            d [s]
        shape : (1,) float64
            T [s]
        """
        return Effect.torque_of(self, signals, coefficients, shape)


def low_passed(torque: Array, constant: float, signals: Signals) -> Array:
    """Torque behind a filter of first order, exact for torque that is constant within a sample, (m, N).

    Parameters
    ----------
    torque : (m, N) float64
        before it [Nm or N]
    constant : float
        time constant T of the filter [s]
    signals : Signals
        the piece of motion, which begins settled, or as its period ends
    """
    kept = float(np.exp(-1.0 / (constant * signals.rate_hz)))
    numerator, denominator = [1.0 - kept], [1.0, -kept]
    if not signals.periodic:
        return signal.lfilter(numerator, denominator, torque, zi=kept * torque[:, :1])[0]
    once, _ = signal.lfilter(numerator, denominator, torque, zi=np.zeros((len(torque), 1)))
    # A period later the filter stands as it stood: y₀ kept^N + the response to one period is y₀ again.
    start = once[:, -1:] / (1.0 - kept ** torque.shape[1])
    return signal.lfilter(numerator, denominator, torque, zi=kept * start)[0]
