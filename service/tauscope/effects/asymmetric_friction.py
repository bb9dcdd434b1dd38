"""Friction that differs with the direction of motion: a worn screw, a preloaded gear."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from tauscope.effects.effect import Effect, per_joint_columns
from tauscope.effects.parameters import Coefficient
from tauscope.effects.setting import Setting
from tauscope.effects.signals import Signals
from tauscope.recording.recording import Array


class AsymmetricCoulomb(Effect):
    """τ = a |A(q̇)|: Coulomb friction is larger by a one way and smaller by a the other."""

    has_step: ClassVar[bool] = True
    of_motion_and_step: ClassVar[bool] = True
    id: ClassVar[str] = "asymmetric_coulomb"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"velocity"})
    equation: ClassVar[str] = "tau = a |sgn(qd)|, sgn smoothed: Coulomb friction F_c + a forwards, F_c - a backwards"
    meaning: ClassVar[str] = "Coulomb friction differs with the direction of motion"
    remedy: ClassVar[str] = "use a Coulomb level for each direction"
    revealing_motion: ClassVar[str] = "slow oscillation with many reversals, so that rest differs from sliding"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("a", "{tau}"),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves both ways."""
        return [cls(joint) for joint in setting.joints if setting.reverses(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """|A(q̇)|.

        Parameters
        ----------
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns(np.abs(signals.step[self.joint])[None, None])


class AsymmetricViscous(Effect):
    """τ = b |q̇|: viscous friction is larger by b one way and smaller by b the other."""

    of_motion_alone: ClassVar[bool] = True
    id: ClassVar[str] = "asymmetric_viscous"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"velocity"})
    equation: ClassVar[str] = "tau = b |qd|: viscous friction F_v + b forwards, F_v - b backwards"
    meaning: ClassVar[str] = "viscous friction differs with the direction of motion"
    remedy: ClassVar[str] = "use a viscous coefficient for each direction"
    revealing_motion: ClassVar[str] = "fast motion in both directions"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("b", "{tau} s/{q}"),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves both ways."""
        return [cls(joint) for joint in setting.joints if setting.reverses(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """|q̇|.

        Parameters
        ----------
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns(np.abs(signals.velocity[self.joint])[None, None])
