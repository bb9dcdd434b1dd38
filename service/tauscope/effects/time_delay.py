"""A torque channel that is late against the positions: by a delay, or behind a low-pass filter."""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect
from tauscope.effects.late_torque import Lag, LateTorque, Shift, shifted
from tauscope.recording.recording import Array


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
        """τ(t - d) - τ(t): friction's step arrives late, it does not become a spike.

        Parameters
        ----------
        coefficients : (1,) float64
            d [s]
        shape : (0,) float64
            none
        """
        torque = self.measured(signals)
        return shifted(torque, float(coefficients[0]), signals) - torque
