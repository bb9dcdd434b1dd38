"""Viscous friction that grows with another power of speed than the first: grease, churning oil."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from tauscope.effects.effect import Effect, per_joint_columns
from tauscope.effects.parameters import Coefficient, Shape
from tauscope.effects.setting import Setting
from tauscope.effects.signals import Signals
from tauscope.recording.recording import Array

POWERS = (np.array([0.35, 0.5, 0.65, 0.8]), np.array([1.25, 1.6, 2.0, 2.4, 3.0]))
"""Powers looked at, below one and above."""

BOUNDS = ((0.3, 0.85), (1.15, 3.5))
"""Powers that are estimated. Nearer to one the column is the nominal model's own, and a coefficient of any size only
cancels that."""


class NonlinearViscous(Effect):
    """τ = c sgn(q̇) |q̇|ᵖ."""

    of_motion_alone: ClassVar[bool] = True
    id: ClassVar[str] = "nonlinear_viscous"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"velocity"})
    equation: ClassVar[str] = "tau = c sgn(qd) |qd|^p"
    meaning: ClassVar[str] = "friction grows with a power of speed other than one"
    remedy: ClassVar[str] = "replace the viscous line by a power of speed"
    revealing_motion: ClassVar[str] = "motion at top speed beside slow motion: half as fast again as so far"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("c", "{tau} (s/{q})^p"),)
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("p", "1"),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """Two a joint that moves: less than in proportion to speed, and more."""
        sides = [
            (powers[:, None], np.array([low]), np.array([high]))
            for powers, (low, high) in zip(POWERS, BOUNDS, strict=True)
        ]
        return [cls(joint, *side) for joint in setting.joints if setting.moves(joint) for side in sides]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """sgn(q̇) |q̇|ᵖ.

        Parameters
        ----------
        shapes : (g, 1) float64
            p
        """
        velocity = signals.velocity[self.joint]
        return per_joint_columns((np.sign(velocity) * np.abs(velocity) ** shapes)[:, None])
