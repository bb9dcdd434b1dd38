"""Elastic torque linear in the link's angle, a spring or counterbalance: τ = k (q - q₀); k in Nm/rad (N/m)."""

from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.joint_law import JointLaw, Law, Side


class JointSpring(JointLaw):
    """τ = k (q - q₀), between two links: the transmission carries it.

    joint : int
        its number, counted from 1
    stiffness : float
        k [Nm/rad or N/m]
    rest : float
        q₀, where the spring is slack [rad or m]
    """

    effect_id: ClassVar[str] = "joint_spring"
    side: ClassVar[Side] = Side.LINK
    stiffness: Number
    rest: Number = 0.0

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        return (lambda q, v: self.stiffness * (q - self.rest)), (lambda q, v: (self.stiffness, 0.0))
