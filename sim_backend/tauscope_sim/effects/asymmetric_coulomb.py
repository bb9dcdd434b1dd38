"""Coulomb friction that differs with the direction of motion: τ = c A(v) for v > 0, else 0; c in Nm (N)."""

from typing import ClassVar

from tauscope.robot.document_fields import Number
from tauscope.robot.robot import Robot
from tauscope_sim.effects.joint_law import FrictionLaw, Law
from tauscope_sim.friction import smooth_sign, smooth_sign_slope


class AsymmetricCoulomb(FrictionLaw):
    """τ = c A(v) for v > 0, else 0.

    joint : int
        its number, counted from 1
    k_v : float or None
        K_v; that of the joint's friction_shape where None [s/rad or s/m]
    amplitude : float
        c: friction of positive motion less that of negative motion [Nm or N]
    """

    effect_id: ClassVar[str] = "asymmetric_coulomb"
    amplitude: Number

    def law(self, robot: Robot) -> Law:
        """τ and its derivatives."""
        k_v = self.steepness(robot)

        def torque(q: float, v: float) -> float:
            return self.amplitude * smooth_sign(v, k_v) if v > 0.0 else 0.0

        def slopes(q: float, v: float) -> tuple[float, float]:
            return 0.0, self.amplitude * smooth_sign_slope(v, k_v) if v > 0.0 else 0.0

        return torque, slopes
