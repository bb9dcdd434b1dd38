"""Viscous friction that differs with the direction of motion: τ = c max(v, 0); c in Nm s/rad (N s/m)."""

from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.joint_law import JointLaw, Law, Side


class AsymmetricViscous(JointLaw):
    """τ = c max(v, 0).

    joint : int
        its number, counted from 1
    amplitude : float
        c: coefficient of positive motion less that of negative motion [Nm s/rad or N s/m]
    """

    effect_id: ClassVar[str] = "asymmetric_viscous"
    side: ClassVar[Side] = Side.FRICTION
    amplitude: Number

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        return (
            lambda q, v: self.amplitude * max(v, 0.0),
            lambda q, v: (0.0, self.amplitude if v > 0.0 else 0.0),
        )
