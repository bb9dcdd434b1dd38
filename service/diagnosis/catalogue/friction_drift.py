"""Friction that changes over time, as grease warms up: an exponential approach to the warm state."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Coefficient, Effect, Shape
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.recording.recording import Array

TIMES = np.array([0.08, 0.2, 0.5, 1.2, 3.0])
"""Time constants looked at, relative to the longest recording."""


class FrictionDrift(Effect):
    """τ = (f A(q̇) + w q̇) exp(-t/T), t from the beginning of each recording."""

    id: ClassVar[str] = "friction_drift"
    equation: ClassVar[str] = "tau = (f sgn(qd) + w qd) exp(-t/T)"
    meaning: ClassVar[str] = "friction changes over time, as in a warm-up"
    remedy: ClassVar[str] = "warm the joint up before recording, or let friction depend on temperature"
    revealing_motion: ClassVar[str] = "the first motion once more at the end"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("f", "{tau}"), Coefficient("w", "{tau} s/{q}"))
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("T", "s", logarithmic=True),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        times = TIMES * max(setting.durations)
        grid = times[:, None], 0.5 * times[:1], 1.5 * times[-1:]
        return [cls(joint, *grid) for joint in setting.joints if setting.moves(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """A(q̇) exp(-t/T), q̇ exp(-t/T), repetition by repetition.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 1) float64
            T [s]
        """
        decay = np.exp(-signals.time[None] / shapes[:, :, None])
        own = np.stack([signals.step[self.joint], signals.velocity[self.joint]])
        return (own[None, :, None, :] * decay[:, None])[:, :, None]
