"""Friction that differs with the direction of motion: a worn screw, a preloaded gear."""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, per_joint_columns
from tauscope.recording.recording import Array


class AsymmetricCoulomb(Effect):
    """τ = a |A(q̇)|: Coulomb friction is larger by a one way and smaller by a the other."""

    has_step = True
    of_motion_and_step = True
    id = "asymmetric_coulomb"
    arguments = frozenset({"velocity"})
    equation = "tau = a |sgn(qd)|, sgn smoothed: Coulomb friction F_c + a forwards, F_c - a backwards"
    meaning = "Coulomb friction differs with the direction of motion"
    remedy = "use a Coulomb level for each direction"
    revealing_motion = "slow oscillation with many reversals, so that rest differs from sliding"
    coefficients = (Coefficient("a", "{tau}"),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One a joint that moves both ways."""
        return [cls(joint) for joint in context.joints if context.reverses(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """|A(q̇)|."""
        return per_joint_columns(np.abs(signals.step[self.joint])[None, None])


class AsymmetricViscous(Effect):
    """τ = b |q̇|: viscous friction is larger by b one way and smaller by b the other."""

    of_motion_alone = True
    id = "asymmetric_viscous"
    arguments = frozenset({"velocity"})
    equation = "tau = b |qd|: viscous friction F_v + b forwards, F_v - b backwards"
    meaning = "viscous friction differs with the direction of motion"
    remedy = "use a viscous coefficient for each direction"
    revealing_motion = "fast motion in both directions"
    coefficients = (Coefficient("b", "{tau} s/{q}"),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One a joint that moves both ways."""
        return [cls(joint) for joint in context.joints if context.reverses(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """|q̇|."""
        return per_joint_columns(np.abs(signals.velocity[self.joint])[None, None])
