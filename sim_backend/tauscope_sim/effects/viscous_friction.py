"""Viscous friction that the given model lacks: τ = c v, with c in Nm s/rad and v in rad/s (N s/m, m/s)."""

from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.joint_law import JointLaw, Law, Side


class ViscousFriction(JointLaw):
    """τ = c v.

    joint : int
        its number, counted from 1
    coefficient : float
        c [Nm s/rad or N s/m]
    """

    effect_id: ClassVar[str] = "viscous_friction"
    side: ClassVar[Side] = Side.FRICTION
    coefficient: Number

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        return (lambda q, v: self.coefficient * v), (lambda q, v: (0.0, self.coefficient))
