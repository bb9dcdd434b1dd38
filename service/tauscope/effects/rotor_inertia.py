"""Reflected inertia of the motor, on its own joint alone."""

from collections.abc import Sequence
from typing import ClassVar

from tauscope.effects.effect import Effect, per_joint_columns
from tauscope.effects.parameters import Coefficient
from tauscope.effects.setting import Setting
from tauscope.effects.signals import Signals
from tauscope.recording.recording import Array


class RotorInertia(Effect):
    """τ = I_a q̈."""

    of_motion_alone: ClassVar[bool] = True
    id: ClassVar[str] = "rotor_inertia"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"acceleration"})
    equation: ClassVar[str] = "tau = I_a qdd"
    meaning: ClassVar[str] = "the motor's reflected inertia is left out"
    remedy: ClassVar[str] = "add the armature inertia to the joint"
    revealing_motion: ClassVar[str] = "fast motion of the joint in other poses of the joints beyond it"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("I_a", "{tau} s^2/{q}", positive=True),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves."""
        return [cls(joint) for joint in setting.joints if setting.moves(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """q̈.

        Parameters
        ----------
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns(signals.acceleration[self.joint][None, None])
