"""A friction level that varies over a turn of the joint: an eccentric bearing, a seal that rubs on one side."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from service.diagnosis.catalogue.effect import Coefficient, Effect, per_joint_columns
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.signals import Signals
from service.recording.recording import Array
from service.robot import JointType


class PositionDependentFriction(Effect):
    """τ = A(q̇) (a cos q + b sin q)."""

    id: ClassVar[str] = "position_dependent_friction"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"position", "velocity"})
    equation: ClassVar[str] = "tau = sgn(qd) (a cos q + b sin q)"
    meaning: ClassVar[str] = "the friction level varies with the joint's angle"
    remedy: ClassVar[str] = "let the Coulomb level vary with the joint's angle"
    revealing_motion: ClassVar[str] = "the same angles under other loads and speeds"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("a", "{tau}"), Coefficient("b", "{tau}"))

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that turns.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        turning = [joint for joint in setting.joints if setting.robot.joints[joint].type is JointType.REVOLUTE]
        return [cls(joint) for joint in turning if setting.moves(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """A(q̇) cos q, A(q̇) sin q.

        Parameters
        ----------
        signals : Signals
            one piece of motion
        shapes : (1, 0) float64
            none
        """
        position, step = signals.position[self.joint], signals.step[self.joint]
        return per_joint_columns(np.stack([step * np.cos(position), step * np.sin(position)])[None])
