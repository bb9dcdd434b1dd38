"""Coulomb friction that the given model lacks: τ = c A(v), with A(v) = (2/π) arctan(K_v v) and c in Nm (N)."""

from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.joint_law import FrictionLaw, Law
from tauscope_sim.friction import smooth_sign, smooth_sign_slope


class CoulombFriction(FrictionLaw):
    """τ = c A(v).

    joint : int
        its number, counted from 1
    k_v : float or None
        K_v; that of the joint's friction_shape where None [s/rad or s/m]
    level : float
        c [Nm or N]
    """

    effect_id: ClassVar[str] = "coulomb_friction"
    level: Number

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        k_v = self.steepness(robot)

        def torque(q: float, v: float) -> float:
            return self.level * smooth_sign(v, k_v)

        def slopes(q: float, v: float) -> tuple[float, float]:
            return 0.0, self.level * smooth_sign_slope(v, k_v)

        return torque, slopes
