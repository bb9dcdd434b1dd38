"""Reflected inertia of the motor, on its own joint alone."""

from collections.abc import Sequence

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, per_joint_columns
from tauscope.recording.recording import Array


class RotorInertia(Effect):
    """τ = I_a q̈."""

    of_motion_alone = True
    id = "rotor_inertia"
    arguments = frozenset({"acceleration"})
    equation = "tau = I_a qdd"
    meaning = "the motor's reflected inertia is left out"
    remedy = "add the armature inertia to the joint"
    revealing_motion = "fast motion of the joint in other poses of the joints beyond it"
    coefficients = (Coefficient("I_a", "{tau} s^2/{q}", positive=True),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One a joint that moves."""
        return [cls(joint) for joint in context.joints if context.moves(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """q̈."""
        return per_joint_columns(signals.acceleration[self.joint][None, None])
