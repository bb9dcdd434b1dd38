"""Viscous friction that grows with another power of speed than the first: grease, churning oil."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Coefficient, Effect, Shape, per_joint_columns
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.recording.recording import Array

POWERS = np.array([0.35, 0.5, 0.65, 0.8, 1.25, 1.6, 2.0, 2.4, 3.0])
"""Powers looked at; near one the column is the nominal model's own."""


class NonlinearViscous(Effect):
    """τ = c sgn(q̇) |q̇|ᵖ."""

    of_motion_alone: ClassVar[bool] = True
    id: ClassVar[str] = "nonlinear_viscous"
    equation: ClassVar[str] = "tau = c sgn(qd) |qd|^p"
    meaning: ClassVar[str] = "friction grows with a power of speed other than one"
    remedy: ClassVar[str] = "replace the viscous line by a power of speed"
    revealing_motion: ClassVar[str] = "motion at top speed beside slow motion: half as fast again as so far"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("c", "{tau} (s/{q})^p"),)
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("p", "1"),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        bounds = {"lower": np.array([0.3]), "upper": np.array([3.5])}
        return [cls(joint, POWERS[:, None], **bounds) for joint in setting.joints if setting.moves(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """sgn(q̇) |q̇|ᵖ.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (g, 1) float64
            p
        """
        velocity = signals.velocity[self.joint]
        return per_joint_columns((np.sign(velocity) * np.abs(velocity) ** shapes)[:, None])
