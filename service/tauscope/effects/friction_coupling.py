"""Friction on the sum or difference of two joints' motion: a motor that turns with both, as in coupled wrists."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tauscope.dynamics import smooth_sign
from tauscope.effects.effect import Effect
from tauscope.effects.parameters import Coefficient, Shape
from tauscope.effects.setting import Setting
from tauscope.effects.signals import Signals
from tauscope.recording.recording import Array

STEEPNESSES = np.array([30.0, 120.0, 500.0, 2000.0])
"""Steepness of the coupled motor's Coulomb step, times the rms of the joint's own speed."""


@dataclass(frozen=True, eq=False)
class FrictionCoupling(Effect):
    """Friction of v = q̇_j + s q̇_k, s = ±1: τ_j = F(v), τ_k = s F(v), F(v) = f A(K v) + w v."""

    of_motion_alone: ClassVar[bool] = True
    id: ClassVar[str] = "friction_coupling"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"velocity", "others"})
    equation: ClassVar[str] = "tau_j = f sgn(v) + w v, tau_k = +-tau_j, v = qd_j +- qd_k"
    meaning: ClassVar[str] = "two joints share friction on the sum or difference of their motion"
    remedy: ClassVar[str] = "add Coulomb and viscous friction of the coupled motor's own speed"
    revealing_motion: ClassVar[str] = "both joints at once, in the same and in opposite directions, slowly and fast"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (
        Coefficient("f", "{tau}", positive=True),
        Coefficient("w", "{tau} s/{q}"),
    )
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("K", "s/{q}", logarithmic=True),)

    partner: int = 0
    sign: int = 1

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """Neighbours, on the sum and on the difference."""
        made = []
        for joint in filter(setting.moves, setting.joints):
            steepness = STEEPNESSES / setting.speed[joint]
            grid = steepness[:, None], 0.3 * steepness[:1], 5.0 * steepness[-1:]
            if joint > 0 and setting.moves(joint - 1):
                made += [cls(joint, *grid, partner=joint - 1, sign=sign) for sign in (1, -1)]
        return made

    def touched(self, joint_count: int) -> tuple[int, ...]:
        """Both joints."""
        return (self.partner, self.joint or 0)

    def where(self, joint_names: Sequence[str]) -> str:
        """Both joints by name."""
        relation = "sum" if self.sign > 0 else "difference"
        return f"{joint_names[self.partner]} and {joint_names[self.joint or 0]} (on the {relation} of their speeds)"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """A(K v) and v on both joints.

        Parameters
        ----------
        shapes : (g, 1) float64
            K [s/rad or s/m]
        """
        velocity = signals.velocity[self.joint] + self.sign * signals.velocity[self.partner]
        step = smooth_sign(velocity, shapes)
        own = np.stack([step, np.broadcast_to(velocity, step.shape)], axis=1)
        return np.stack([self.sign * own, own], axis=2)
