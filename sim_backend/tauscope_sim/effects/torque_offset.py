"""Constant torque of a joint: τ = c, in Nm (N)."""

from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.joint_law import JointLaw, Law


class TorqueOffset(JointLaw):
    """τ = c.

    joint : int
        its number, counted from 1
    torque : float
        c [Nm or N]
    """

    effect_id: ClassVar[str] = "torque_offset"
    torque: Number

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        return (lambda q, v: self.torque), (lambda q, v: (0.0, 0.0))
